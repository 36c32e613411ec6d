"""Solids under large deformation: neo-Hookean tetrahedra that never invert."""
