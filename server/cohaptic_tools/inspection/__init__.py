"""Inspects an object before anybody touches it: quality, cost, limits of the model, a picture.

Terms:
    quality: Dihedral angles [degrees] and volume ratios of the tetrahedra.
    sliver: Tetrahedron whose volume ratio is below 0.01.
    cost: Measured duration of a tick [s].
    K_o: Stiffness at a surface vertex: force per displacement under a fingertip [N/m].
    part: Named region of an object with its own material.
    held: Fixed: a held node does not move.
    section: Cut through the tetrahedra by a plane.
"""
