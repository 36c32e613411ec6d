"""Listening sockets, and accepted connections that have not sent a request yet.

Terms:
    door: Listening socket of the server.
    porch: Set of accepted connections that have not sent a whole request yet.
    silent: A connection is silent while it is on the porch.
    head: First lines of an HTTP request, up to the empty line.
    unit: Measure of the door's work, about 30 us of processor time.
"""
