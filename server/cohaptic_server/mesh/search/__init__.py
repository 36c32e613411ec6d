"""Searches near one point of a surface, in loops that are compiled if a compiler is available.

`cohaptic_server.mesh` defines the terms.
"""
