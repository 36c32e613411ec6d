"""Many rooms on one port, each in a process of its own that a supervisor keeps alive."""
