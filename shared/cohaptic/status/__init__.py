"""A loop's recorded rows, a client's status reports, and their display in a terminal.

Terms:
    row: Record of one haptic period, as numbers with named columns.
    visit: Time from a client's joining to its leaving.
    level: Position of a simulated hand between released (0) and pressed (1).
    gain: Stiffness K_h with which the client's law presses on the surface [N/m].
    lag: Time constant with which the object answers forces in a room [s].
    wanted: Normal force that the law computes, before the safety layer limits it [N].
    soft device: Device that cannot stably render the object's stiffness.
"""
