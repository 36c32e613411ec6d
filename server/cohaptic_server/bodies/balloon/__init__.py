"""Two models of a water balloon, linear and nonlinear: rubber round a constant volume.

Terms:
    base: Lowest part of the balloon, whose vertices are fixed.
    stretch: Ratio of the inflated to the unstretched radius.
    mu h: Shear modulus times thickness of the unstretched rubber [N/m] (`mu_h`).
    g: Gradient dV/dx of the water's volume by the vertex positions [m^2].
    tangent K: Derivative of the internal forces by the vertex positions [N/m].
    strain: Row of ten numbers for each triangle, as in `tension_field.py`.
    taut, wrinkled, slack: Triangle with tension along two, one or no axes.
    cap: Vertices that are eliminated last, after the row of the volume.
    beyond: Number of the tangent's blocks; as an index it marks a block to leave out.
"""
