"""Boards with one motor and one sensor, on the firmware of `examples/one_axis_board`."""
