"""Seats of a room: ownership of names, changes of names, and the queue for a free seat.

Terms:
    claim: Data by which a client shows that a name is its own: secret, session, network address.
    kept: A name or seat is kept if the room reserves it for a client that lost its connection.
    skeleton: Form of a name that is equal for all names that look alike (Unicode TS 39).
    place: Position of a client in the queue for a seat.
    call: To offer a free seat to a waiting client.
    turn: Time that a called client has to take its seat [s].
    waiter: Client that has a place in the queue.
"""
