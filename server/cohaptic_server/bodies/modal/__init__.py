"""Inertia of a linear body by its lowest natural modes, so that jelly wobbles (science 3.14)."""
