"""Drivers of devices with motors or buttons, each known to the client by an entry point.

The drivers import `cohaptic_client.devices` and no other part of the client. Read first
`vendor/forcedimension.py`, the shortest, then `haply/inverse3.py`, whose transport waits.

Terms:
    reported: Newest report that a board or service has sent; None if none has come.
    send: Pass a force [N], or motor currents [A or mA], to the thread or the port that sends it.
    poll: Return the newest report since the last call, without waiting.
    silence: Time without a report from the hardware, or without a force from the loop [s].
    release: Set the force on the hand to zero at once, from any thread.
    unit: One particular device, with the values that a TOML file gives for it.
    counts: Position as an encoder or sensor reports it, a number without a unit.
    inward: Direction in which the hand presses into the object; a unit vector.
"""
