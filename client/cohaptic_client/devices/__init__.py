"""Haptic and input devices, one per file, behind the Protocol in `device.py`."""
