"""Upload of mesh files by pages: one upload at a time, read in a separate process."""
