"""Runs the haptic loop over a device, and handles the start and end of the loop's process.

Terms:
    parent: Network process of the client, which has started the loop's process.
    heartbeat: Command of the parent; without one for `ORPHANED_AFTER` [s] the loop ends.
    orphaned: State of a loop whose parent sends no heartbeats any more.
    interrupted: State of a loop that ends because of a signal.
    housekeeping: Work that the loop does 20 times a second and not in every period.
    late: Time by which a period starts after it was due [s].
    stall: Device call or period longer than `SafetyLimits.stall` [s].
    release: Take the force off the hand: on a ramp (`Release`) or at once (`Releasable`).
"""
