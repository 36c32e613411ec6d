"""Objects that a user brings: from a file to a body that a tick can afford."""
