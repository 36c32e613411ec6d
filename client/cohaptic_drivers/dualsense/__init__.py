"""The Sony DualSense gamepad: its trigger is a probe along one axis, its sticks move the probe.

Terms:
    pull: Position of the trigger, 0 (released) to 255.
    press: Distance by which the trigger moves the tip inward [m].
    base: Position of the tip along `inward` while the trigger is released [m].
    room: Region near the object in which the sticks move the tip [m].
    cursor: Position and velocity of the tip, along the axes of the pad [m, m/s].
    effects: Resistance of the trigger and rumble of the motors, each 0 to 255.
    full: Force that the largest resistance stands for [N].
    held: State of sticks, trigger and buttons in one report (`Held`).
"""
