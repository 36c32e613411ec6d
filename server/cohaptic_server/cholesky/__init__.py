"""Sparse Cholesky factorisation: ordering, analysis, factorisation and refactorisation.

Terms:
    node: Mesh node with three unknowns, its displacement in x, y, z; matrices have 3x3 blocks.
    part: Set of nodes that are eliminated together: a leaf or a separator of the dissection.
    front: Dense matrix of one part: the rows and columns of its own unknowns and of its border.
    own: Of unknowns: those that a front eliminates.
    border: Unknowns of ancestors, eliminated later, to which a front's own unknowns are coupled.
    update: Contribution of a front's own unknowns to its border, added to the parent front.
    root: Front that is eliminated last.
    retained: Of a node: later solves apply forces to it or need its displacement.
    press: Forces on a few nodes, in one direction, that sum to 1.
    pattern: Positions of the nonzero blocks of a matrix, without their values.
"""
