"""Listening sockets, and those who have come to them and have not asked for anything yet."""
