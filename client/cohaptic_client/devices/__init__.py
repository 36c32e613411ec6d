"""The Protocol of a device, the simulated one and the SpaceMouse; drivers: `cohaptic_drivers`."""
