"""Boards with one motor and one sensor, on the firmware of `examples/one_axis_board`.

Terms:
    handle: Lever on the motor that the hand moves along an arc; its middle is at 0 [m].
    axis: Direction in which the hand presses the handle; a unit vector.
    counts: Position as the board's sensor reports it, a number without a unit.
    command: Message to the board with a motor current [A]; the board answers with a report.
    description: Limits and sensor of a board as the board states them, on request.
    nudge: Short motion of the handle by the motor during calibration.
    unit: One particular handle, with the values that its TOML file gives.
"""
