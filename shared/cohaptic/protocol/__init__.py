"""Every message on the wire: one per file, checked when it is read."""
