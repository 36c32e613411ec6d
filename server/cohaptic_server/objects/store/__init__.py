"""What was prepared once is kept: a bounded folder of arrays that are mapped, not read."""
