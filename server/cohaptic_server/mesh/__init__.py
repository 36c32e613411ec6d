"""Meshes of surfaces and of solids: their geometry and what is measured on them, no elasticity."""
