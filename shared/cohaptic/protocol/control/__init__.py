"""Parts of control messages."""
