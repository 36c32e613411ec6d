"""Budgets: how much of the server one connection and one address may take. No I/O."""
