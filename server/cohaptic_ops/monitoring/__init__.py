"""Monitoring of a running server for its operators: metrics, health, and an overview.

Terms:
    admin port: Port on which a separate process answers operators' HTTP requests.
    line: Message between the server and that process, as one line of JSON.
    metrics: Numbers that describe one room, reported once a second.
    health: State of the server and of its rooms: idle, starting, open, broken or stopped.
    stale: A report is stale if it is older than `STALE` [s].
    alive: A server is alive if its last report is not stale.
    ready: A server is ready if people may be sent to it.
    ticking: A room ticks if its tick counter has grown within `STALE`.
    seat: Number of a user in the metrics, from 1; bounds the number of time series.
    loss: Fraction of a user's samples that no tick has used, 0 to 1.
"""
