"""Seats of a room: ownership of names, changes of names, and the queue for a free seat."""
