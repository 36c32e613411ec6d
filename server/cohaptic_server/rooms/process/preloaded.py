"""What the process that rooms are forked from has imported: a room is back within a moment."""

from __future__ import annotations

from cohaptic_server.objects import catalogue
from cohaptic_server.rooms.process import room_process

IMPORTED = (catalogue, room_process)
