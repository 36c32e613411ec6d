"""Messages on the wire; each message is checked when it is read."""
