"""Who may sit in a room: how many seats there are, whose a name is, and who waits for a place."""
