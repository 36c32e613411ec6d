"""Rate limits of connections and addresses, and the addresses that trusted proxies report. No I/O.

Terms:
    source: Address or network that shares budgets: an IPv4 address, or an IPv6 /64 network.
    budget: Rate limit of one kind of request: a rate [1/s] and a burst.
    bucket: State of one budget: the time at which it is full again [s].
    sample: Small binary message of a user, one per tick.
    text: Control message, or any fragment of a message.
    beat: Ping, pong or close of a websocket.
    point: Message with which a watcher points at the surface.
    dismissal: Closing of a connection because it has exceeded a budget.
    unread: Of bytes: sent in HTTP responses that a client has not taken yet.
"""
