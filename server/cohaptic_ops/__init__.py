"""A server with many rooms, each in a separate process, and the monitoring of a server.

Terms:
    rooms_server: Process that accepts all connections and runs the rooms' processes.
    supervisor: Part of the rooms server that keeps the process of one room running.
    admin port: Port on which operators read metrics and health.
    draining: State of a server that admits no more clients because it is about to end.
    lifeline: Pipe on standard input; the server ends when the pipe closes.
"""
