"""Access control: keys, signed tokens with grants, and tokens for a single use. No I/O."""
