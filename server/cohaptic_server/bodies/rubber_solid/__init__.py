"""Solids under large deformation: neo-Hookean tetrahedra that never turn inside out."""
