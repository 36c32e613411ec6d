"""Many rooms on one port, each in a separate process that a rooms server keeps running.

Terms:
    router: Part of the rooms server that accepts connections and hands each to a room.
    place: Receiver of connections: a room's supervisor, or the server's own site.
    site: HTTP service of the rooms server itself, with the list of rooms.
    hand over: To pass an open socket to another process over a unix socket.
    supervisor: Part of the rooms server that keeps the process of one room running.
    lease: Right of one process to be a room for a limited time [s], renewed by its reports.
    epoch: Number that increases with each owner of a room (fencing token).
    idle: A room is idle if it has no process, and gets one when somebody comes.
    held seats: Seats that the rooms server has assigned to a room, whether taken or not.
    target: Path and query of an HTTP request.
"""
