"""Solids under large deformation: neo-Hookean tetrahedra that never invert.

Terms:
    F: Deformation gradient of an element at a point, a row of nine numbers.
    J: Determinant of F, the ratio of deformed to resting volume; inverted elements have J < 0.
    mu, lame: Lame's second and first constant of each element at small strains [Pa].
    points: Quadrature points of an element, on a lattice of thirds (`quadrature.py`).
    corners: Corners of an element, at which F is computed and from which it is interpolated.
    bounds: Lower bounds of J between the points, from Bernstein coefficients.
    stiffened: Tangent without the parts of its moduli that can make it indefinite.
    swell: Derivative of J by the node positions, dJ/dx [1/m].
    fractions: Nodal forces of each load per unit of its force.
"""
