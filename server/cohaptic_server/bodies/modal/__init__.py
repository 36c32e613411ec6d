"""Inertia of a linear body by its lowest natural modes, so that a jelly wobbles (science 3.14)."""
