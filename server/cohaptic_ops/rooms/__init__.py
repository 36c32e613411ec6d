"""Many rooms on one port, each in a separate process that a supervisor keeps alive."""
