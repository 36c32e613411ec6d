"""The Sony DualSense gamepad: its trigger as a probe of one axis, its sticks as a cursor."""
