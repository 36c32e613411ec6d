"""Listening sockets, and accepted connections that have not sent a request yet."""
