"""Objects that a page brings: one upload at a time, read in a process of its own."""
