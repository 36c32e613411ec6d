"""Counts of `../house.py`: modules that a piece of work crosses, files that a change touches."""
