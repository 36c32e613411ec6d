"""Stability of one contact, of several, and of a room of contacts with its delays."""
