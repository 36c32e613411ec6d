"""Devices that need their maker's library, which is loaded only when such a device is chosen."""
