"""Time constants of a room: the lag of its forces, and the lag with which contacts turn."""
