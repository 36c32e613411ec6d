"""Force on a sliding hand: its error against the reference."""
