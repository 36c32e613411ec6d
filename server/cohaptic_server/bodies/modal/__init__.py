"""Gives a linear body inertia by its lowest natural modes: jelly wobbles (science 3.14)."""
