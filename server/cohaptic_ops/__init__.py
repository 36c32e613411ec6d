"""A server with many rooms, each in a separate process, and the monitoring of a server."""
