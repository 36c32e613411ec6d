"""WoodenHaptics, Polhem and vintage Phantoms on their boards: serial, and three kinds of HID.

Terms:
    arm: One device of this family, with three motors and three encoders.
    kind: Kinematics of an arm: woodenhaptics, polhem or vintage.
    board: Electronics of an arm: the serial board, or a HID board of generation h1, h2 or h3.
    counts: Position as an encoder reports it, a number without a unit.
    home pose: Pose of an arm in which the counters are set to zero.
    reported: Report of a board: counts, button and errors (`Told`).
    unit: One particular arm, with the values of its kind or of its TOML file.
"""
