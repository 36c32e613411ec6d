"""The balloon, built once in the process that rooms are forked from, in a second of one core.

Rooms with a balloon share its memory, and such a room is back at once after its process was
killed. Only a server with such a room imports this module.
"""

from __future__ import annotations

from threadpoolctl import threadpool_limits

from cohaptic_server.bodies.balloon.balloon import Balloon

with threadpool_limits(limits=1):  # more threads would wait for each other beside other processes
    BALLOON = Balloon()
    # Search structures that every room needs; computed here so that rooms share them.
    SEARCHED = BALLOON.mesh.contacts, BALLOON.mesh.near_tree
