"""Tools: the demonstration with several hands, and the inspection of an object from a file."""
