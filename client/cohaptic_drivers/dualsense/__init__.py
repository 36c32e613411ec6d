"""The Sony DualSense gamepad: its trigger is a probe along one axis, its sticks move the probe."""
