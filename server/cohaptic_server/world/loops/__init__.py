"""Loops of a tick over all users of a room, compiled where a compiler is at hand."""
