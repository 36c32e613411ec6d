"""Towards the server: protocol, pacing, time, delay lines."""
