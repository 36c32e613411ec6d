"""A mesh from a visitor: the limits, and the process that reads and prepares it."""
