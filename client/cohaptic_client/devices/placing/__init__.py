"""Placing a device's workspace in the world: scale, rotation, clutch, centring; for all devices."""
