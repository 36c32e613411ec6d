"""Files with keys, certificates and a room's journal: read, written, and reloaded on change."""
