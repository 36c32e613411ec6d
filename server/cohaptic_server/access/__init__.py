"""Admission of clients and their rights: keys, signed tokens with grants, single use. No I/O."""
