"""Who else is here: how many watch, whose view is followed, who points at what. No I/O."""
