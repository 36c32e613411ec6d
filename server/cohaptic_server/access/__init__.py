"""Who may come in and what for: keys, signed tokens with grants, single use. No I/O."""
