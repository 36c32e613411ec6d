"""Meshes of surfaces and of solids: geometry, measurements and searches, without elasticity.

Terms:
    foot: Point on a face of the resting mesh at which a probe's contact lies [m].
    contact point: Point of the smooth resting surface above the foot [m].
    frame: Foot, contact point and outward unit normal of a contact, as rows of shape (3, 3).
    pressure: Shares of a contact's force on the vertices `under` it: `weights` that sum to 1.
    quadrature points: Points spread evenly over the faces, at which a pressure is evaluated.
    loaded field: Displacement field that a `LoadedField` holds at present [m].
    lacking: Whether a search has needed a displacement that the loaded field does not contain.
    touch mesh: Subset of a surface's vertices with triangles between them, for fine meshes.
    path: Points along the surface ahead of a sliding contact.
    window: Vertices round one contact at which a tick evaluates the displacement.
"""
