"""Objects in closed form or from a seed, and the files that hold them; each is reproducible."""
