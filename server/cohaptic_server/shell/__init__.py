"""Connects the server to sockets, processes and the clock; other packages make all decisions."""
