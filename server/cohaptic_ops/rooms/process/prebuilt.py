"""Builds the balloon once in the starter, the process from which rooms are forked.

Building takes a second of one core. Rooms with a balloon share its memory, and such a room opens
again at once if its process was killed. Only a server with such a room imports this module.
"""

from __future__ import annotations

from threadpoolctl import threadpool_limits

from cohaptic_server.bodies.balloon.balloon import Balloon

with threadpool_limits(limits=1):  # several threads would wait for each other on busy cores
    BALLOON = Balloon()
    # Search structures that every room needs; computed here so that rooms share them.
    SEARCHED = BALLOON.mesh.contacts, BALLOON.mesh.near_tree
