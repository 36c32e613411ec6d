"""Drivers of devices with motors or buttons, each known to the client by an entry point.

They import the client's devices (`cohaptic_client.devices`) and nothing else of it. Read first
`vendor/forcedimension.py`, the shortest, then `haply/inverse3.py`, whose transport waits.
"""
