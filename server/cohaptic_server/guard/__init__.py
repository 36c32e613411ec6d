"""Budgets of a connection and of an address, and which address a trusted proxy names. No I/O."""
