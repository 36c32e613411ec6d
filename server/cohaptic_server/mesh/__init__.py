"""Meshes of surfaces and of solids: geometry and measurements, without elasticity."""
