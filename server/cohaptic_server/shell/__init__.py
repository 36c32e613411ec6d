"""Connects the server to sockets, processes and the clock; other packages make all decisions.

Terms:
    acceptor: Listening socket of the server.
    limiter: Object that admits connections by rate limits, and counts them.
    source: Network address, or group of addresses, against whose rate limits a connection counts.
    budget: Amount of messages, bytes or connections that a rate limit still allows.
    wire: Websocket connection to one client.
    endpoint: Further kind of websocket connection, beside those of users and watchers.
    column: Displacements of the surface under a unit force on one vertex [m/N].
    block: Green's functions of one vertex, encoded for pages.
    page: Web page of a user or watcher.
    exchange: Replacement of the served body while the server runs.
"""
