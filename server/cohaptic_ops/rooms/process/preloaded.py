"""Imports all modules that a room needs into the starter, from which rooms are forked.

A forked room starts fast, since it need not import the modules, and all rooms share their memory.
The starter imports this module last.
"""

from __future__ import annotations

from cohaptic_ops.rooms.process import room_process
from cohaptic_server.access import tokens
from cohaptic_server.bodies import spring
from cohaptic_server.bodies.balloon import balloon, rubber_balloon
from cohaptic_server.objects import build, build_rubber
from cohaptic_server.objects.inertia import modes_of
from cohaptic_server.process_memory import keep_what_there_is

IMPORTED = (balloon, build, build_rubber, modes_of, room_process, rubber_balloon, spring, tokens)
keep_what_there_is()
