"""Solids under large deformation: neo-Hookean tetrahedra that are never inverted."""
