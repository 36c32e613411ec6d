"""Settings of the operating system and the event loop: signals, scheduling, sockets.

Terms:
    direct: A socket or timer that the event loop serves within `select`, without asyncio's handles.
    lifeline: Standard input of a child process; when it closes, the parent has ended.
    hang-up: The signal SIGHUP, which the system sends when a terminal closes.
    leftover: File of an ended process, which no process has locked any more.
"""
