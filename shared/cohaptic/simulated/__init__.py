"""Simulated hands and links, for clients without a device and sessions without a network."""
