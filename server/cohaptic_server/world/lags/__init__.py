"""Time constants with which a room answers: of forces, and of what others do to a contact."""
