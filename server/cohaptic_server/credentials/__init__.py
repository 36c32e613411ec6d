"""Reads, writes and reloads the files with keys, certificates and the journal of a room."""
