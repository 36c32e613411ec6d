"""When contacts are stable: one, several, and a room of them with its delays."""
