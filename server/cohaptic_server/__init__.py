"""The authoritative server: one deformable body, everybody's forces on it, one tick at a time."""
