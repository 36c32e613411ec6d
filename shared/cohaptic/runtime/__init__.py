"""Settings of the operating system and the event loop: signals, scheduling, sockets."""
