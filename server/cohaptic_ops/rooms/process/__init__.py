"""Starts the process of one room, exchanges messages with it, and hands connections over to it.

Terms:
    channel: Socket pair for messages between a room's process and the rooms server.
    line: One message on the channel, as a line of JSON.
    hand over: To pass an open socket to another process over a unix socket (SCM_RIGHTS).
    number: Number of a connection that is handed over; it is sent back when that one ends.
    starter: Process that has imported all modules, and from which rooms are forked.
    hold: Handle that can kill a room's process even after the starter has ended.
"""
