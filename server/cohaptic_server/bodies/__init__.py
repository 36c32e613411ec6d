"""Deformable bodies: the displacement under the forces of contacts.

Terms:
    load: Force along a unit vector [N], distributed over the vertices under a contact (`Load`).
    weights: Share of a load's force on each vertex; they sum to 1.
    field: Displacement of every vertex per unit force of one load [m/N].
    compliance C: C_ij is the displacement of contact i per unit force at contact j [m/N].
    response: Displacement, compliance and energy of a body under its loads (`Response`).
    before: Response of the previous tick; None to start from rest.
    own loads: Loads of one user; the user's free surface is the one without them.
    rest: State of the body without loads.
    swing: Displacement by the deviations of natural modes from their static amplitudes [m].
    dead load: Force that keeps its direction while the surface moves.
"""
