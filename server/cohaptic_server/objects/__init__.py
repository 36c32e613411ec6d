"""From a file that somebody brings to a solid body: read, check, fill with tetrahedra, hold."""
