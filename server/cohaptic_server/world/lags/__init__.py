"""Time constants of a room: of its forces, and of the turning of contacts by others."""
