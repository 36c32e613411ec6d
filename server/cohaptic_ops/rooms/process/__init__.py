"""The process of one room: its start, its messages, and the connections handed over to it."""
