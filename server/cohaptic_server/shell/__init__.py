"""The only part with sockets, processes and a clock: it decides nothing."""
