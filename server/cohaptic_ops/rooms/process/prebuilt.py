"""The balloon, made once in the process that rooms are forked from; it takes a second of a core.

A room that has it shares its memory with the others, and is back in a moment after its process was
killed. Only a server with such a room imports this module.
"""

from __future__ import annotations

from threadpoolctl import threadpool_limits

from cohaptic_server.bodies.balloon.balloon import Balloon

with threadpool_limits(limits=1):  # beside other processes, more threads wait for each other
    BALLOON = Balloon()
    # What a room makes of it before anybody may come.
    SEARCHED = BALLOON.mesh.contacts, BALLOON.mesh.near_tree
