"""The only part of the server with sockets, processes and a clock; all decisions lie elsewhere."""
