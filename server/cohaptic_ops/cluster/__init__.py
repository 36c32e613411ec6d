"""Rooms on several machines: who owns a room, how nodes find it, and what the engine has to say.

Terms:
    node: One `cohaptic serve --cluster` on one machine.
    engine: Program of others (Ray) that knows the machines and places rooms on them.
    witness: Node that the configuration names to grant rooms; see `leases`.
    lease: Right of one process to own a room for a limited time [s].
    epoch: Number that increases with each owner of a room (fencing token).
    pass on: To carry the bytes of a connection to the node that owns the room.
"""
