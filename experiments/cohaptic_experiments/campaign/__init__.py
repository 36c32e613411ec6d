"""Thousands of rooms with hands of every kind: which are stable, slow, soft."""
