"""Searches round one place of a surface, in loops that are compiled where a compiler is at hand."""
