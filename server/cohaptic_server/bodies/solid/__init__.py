"""Linear elastic solids of tetrahedra: factored once, exact near contacts, sampled far away.

Terms:
    column: Displacement of surface vertices per unit force on one vertex in x, y, z [m/N].
    row: Nine numbers of a column: motion of one vertex in x, y, z for a force in x, y, z.
    place: Group of 32 vertices that are close on the surface; a column stores whole places.
    rank: Position of a vertex in the order of a column's rows, place after place.
    kind: Number of the set of places that a column stores.
    slot, slab: Memory for one column, and the array of all slots in single precision.
    share (fade-in): Weight of a column, which rises from 0 to 1 after the column arrives.
    sample: Vertex of the surface at which the far field is computed.
    far field: Compliance between samples, interpolated for all other vertices.
    press: Unit force with the pressure of a contact centred at a vertex.
"""
