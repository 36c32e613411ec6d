"""Many rooms on one port, each in a separate process that a supervisor keeps running.

Terms:
    front: Part of the supervisor that accepts connections and hands each to a room.
    place: Receiver of connections: a room's keeper, or the server's own site.
    site: HTTP service of the supervisor itself, with the list of rooms.
    hand over: To pass an open socket to another process over a unix socket.
    keeper: Part of the supervisor that keeps the process of one room running.
    lease: Right of one process to be a room for a limited time [s], renewed by its reports.
    epoch: Number that increases with each owner of a room (fencing token).
    idle: A room is idle if it has no process, and gets one when somebody comes.
    held seats: Seats that the supervisor has assigned to a room, whether taken or not.
    target: Path and query of an HTTP request.
"""
