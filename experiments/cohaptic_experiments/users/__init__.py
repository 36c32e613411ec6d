"""Several users in one session: over the delay, over their number, in a ring."""
