"""Keys and certificates in files: read, written, and read again when they change."""
