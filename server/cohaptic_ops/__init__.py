"""A server with many rooms, each in a process of its own, and the monitoring of a server."""
