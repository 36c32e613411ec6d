"""Starts the process of one room, exchanges messages with it, and hands connections over to it."""
