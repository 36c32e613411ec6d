"""The interface of all devices, the simulated device and the SpaceMouse; see `cohaptic_drivers`.

Terms:
    tip: End point of the device that touches the body; its position is a `Vec3` [m].
    kind: A driver's entry in the catalogue: name, options, and functions that find and open
        devices.
    choice: Name of a device with the options that the user typed after `--device`.
    info: Abilities of a device: its limits of force [N], stiffness [N/m] and damping [N s/m].
    found: Device that a search of this machine has found, with a problem if it cannot be used.
    fresh: A sample is fresh while the hardware sends reports.
    lets_go: Time without a new force after which the device itself drops the force [s].
    switch: Button that the hand holds together with the device, as a dead man's switch.
    knock: Gentle push by which a user recognises a device and checks its direction.
    intention: Intended position of a simulated hand's tip over time [m].
"""
