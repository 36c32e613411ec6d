"""Finds all problems of a file at once, and options that make it touchable."""
