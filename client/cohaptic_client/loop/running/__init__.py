"""Runs the haptic loop over a device, and handles the start and end of the loop's process."""
