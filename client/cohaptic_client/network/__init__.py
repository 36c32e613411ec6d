"""The client's side of the connection: protocol, pacing, timing, delay lines.

Terms:
    link: One websocket connection to the server, with the latency that the settings inject.
    session: State machine of the protocol on one link (`ClientSession`).
    session token: Token by which a client returns to a room without its invitation (`session`).
    conversation: Exchange of messages on one link, between the server and the haptic loop.
    sample: Message to the server with the tip [m] and the force on the hand [N], one per tick.
    sample_wait: Time that a sample waits at the server for the tick that uses it [s].
    phase: Time of a sample within the simulation period, relative to the server's ticks [s].
    pacer: Schedule of the samples, which locks their phase to the server's ticks.
    passage: One measured round trip, from a sample to the patch that answers it [s].
"""
