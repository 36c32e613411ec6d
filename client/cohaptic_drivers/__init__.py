"""Drivers of devices with motors or buttons, each known to the client by an entry point.

The drivers import `cohaptic_client.devices` and no other part of the client. Read first
`vendor/forcedimension.py`, the shortest, then `haply/inverse3.py`, whose transport waits.
"""
