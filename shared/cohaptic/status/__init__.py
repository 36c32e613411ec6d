"""A loop's recorded rows, a client's status reports, and their display in a terminal."""
