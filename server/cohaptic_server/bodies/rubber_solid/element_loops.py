"""Loops over hyperelastic tetrahedra; `rubber_tetrahedra.py` has the matrix products between them.

The loops are compiled where there is a compiler (`element_loops.pxd` has the types), run without
the global interpreter lock, and do not check shapes.

Sizes: m elements, a nodes of an element, c corners at which the deformation gradient is taken, r
pairs of these corners, and q quadrature points. Symbols: barycentric coordinates L_s, shape
functions N_a, resting position X, y_s = dx/dL_s, and the volumetric energy U(J) of
`rubber_tetrahedra.py`. A deformation gradient F_ip is a row of nine, with index 3 i + p.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cohaptic_server.numeric import Floats, Ints

if TYPE_CHECKING:
    from cohaptic_server import plain_cython as cython
else:
    try:
        import cython
    except ModuleNotFoundError:
        from cohaptic_server import plain_cython as cython


def corner_gradients(
    x: Floats,
    elements: Ints,
    gradients: Floats,
    nodes: Ints,
    factors: Floats,
    out: Floats,
) -> None:
    """Compute the deformation gradients at the corners, F_ip = sum_s y_si dL_s/dX_p.

    Args:
        x: Positions of the nodes, shape (n, 3) [m].
        elements: Nodes of each element, shape (m, a).
        gradients: Gradients dL_s/dX_p of the barycentric coordinates, shape (m, 4, 3) [1/m].
        nodes: Node of the element that, with node s, determines y_s at each corner, shape (c, 4).
        factors: Factor of that node in y_s, and factor of node s, shape (c, 4, 2).
        out: Receives the deformation gradients, shape (m, 9, c).
    """
    with cython.nogil:
        for e in range(len(elements)):
            for c in range(len(nodes)):
                for i in range(3):
                    y0 = (
                        factors[c, 0, 0] * x[elements[e, nodes[c, 0]], i]
                        + factors[c, 0, 1] * x[elements[e, 0], i]
                    )
                    y1 = (
                        factors[c, 1, 0] * x[elements[e, nodes[c, 1]], i]
                        + factors[c, 1, 1] * x[elements[e, 1], i]
                    )
                    y2 = (
                        factors[c, 2, 0] * x[elements[e, nodes[c, 2]], i]
                        + factors[c, 2, 1] * x[elements[e, 2], i]
                    )
                    y3 = (
                        factors[c, 3, 0] * x[elements[e, nodes[c, 3]], i]
                        + factors[c, 3, 1] * x[elements[e, 3], i]
                    )
                    for p in range(3):
                        out[e, 3 * i + p, c] = (
                            y0 * gradients[e, 0, p]
                            + y1 * gradients[e, 1, p]
                            + y2 * gradients[e, 2, p]
                            + y3 * gradients[e, 3, p]
                        )


def nodal_forces(
    stresses: Floats,
    elements: Ints,
    gradients: Floats,
    nodes: Ints,
    factors: Floats,
    out: Floats,
) -> None:
    """Add the forces of the elements to the nodes: the transpose of `corner_gradients`.

    Args:
        stresses: Integrals of stress times the corners' shape functions, shape (m, 9, c) [N m].
        elements: As in `corner_gradients`.
        gradients: As in `corner_gradients`.
        nodes: As in `corner_gradients`.
        factors: As in `corner_gradients`.
        out: Receives the sum of the nodal forces, shape (n, 3) [N].
    """
    with cython.nogil:
        for e in range(len(elements)):
            for c in range(len(nodes)):
                for s in range(4):
                    for i in range(3):
                        f = (
                            stresses[e, 3 * i, c] * gradients[e, s, 0]
                            + stresses[e, 3 * i + 1, c] * gradients[e, s, 1]
                            + stresses[e, 3 * i + 2, c] * gradients[e, s, 2]
                        )
                        out[elements[e, nodes[c, s]], i] += factors[c, s, 0] * f
                        out[elements[e, s], i] += factors[c, s, 1] * f


def cofactors(F: Floats, e: int, q: int, cof: Floats) -> float:
    """Write the cofactors of a deformation gradient, shape (9,); return its determinant J.

    Args:
        F: Deformation gradients, shape (m, 9, q).
        e: Element.
        q: Quadrature point.
        cof: Receives the cofactors, shape (9,).
    """
    a, b, c = F[e, 0, q], F[e, 1, q], F[e, 2, q]
    d, f, g = F[e, 3, q], F[e, 4, q], F[e, 5, q]
    h, k, m = F[e, 6, q], F[e, 7, q], F[e, 8, q]
    cof[0] = f * m - g * k
    cof[1] = g * h - d * m
    cof[2] = d * k - f * h
    cof[3] = c * k - b * m
    cof[4] = a * m - c * h
    cof[5] = b * h - a * k
    cof[6] = b * g - c * f
    cof[7] = c * d - a * g
    cof[8] = a * f - b * d
    return float(a * cof[0] + b * cof[1] + c * cof[2])


def stresses(F: Floats, weights: Floats, mu: Floats, lame: Floats, J: Floats, cof: Floats) -> float:
    """Replace the deformation gradients by first Piola-Kirchhoff stresses times weights.

    Args:
        F: Deformation gradients, shape (m, 9, q); an inverted one stays unchanged.
        weights: Weights of the quadrature points, shape (m, q) [m^3].
        mu: Shear modulus, shape (m,) [Pa].
        lame: Lame's first constant, shape (m,) [Pa].
        J: Receives the determinants, shape (m, q).
        cof: Working memory, shape (9,).

    Returns:
        Energy of the elements without its logarithmic part [J].
    """
    energy = 0.0
    with cython.nogil:
        for e in range(len(F)):
            for q in range(len(J[0])):
                det = cofactors(F, e, q, cof)
                J[e, q] = det
                if det > 0.0:
                    w = weights[e, q]
                    swell = (det - 1.0) * (det + 1.0)
                    squares = 0.0
                    spread = w * (mu[e] - 0.5 * lame[e] * swell) / det
                    for i in range(9):
                        squares += F[e, i, q] * F[e, i, q]
                        F[e, i, q] = w * mu[e] * F[e, i, q] - spread * cof[i]
                    energy += w * (0.5 * mu[e] * (squares - 3.0) + 0.25 * lame[e] * swell)
    return energy


def moduli(
    F: Floats,
    gradients: Floats,
    weights: Floats,
    shapes: Floats,
    terms: Ints,
    mu: Floats,
    lame: Floats,
    cof: Floats,
    scratch: Floats,
    swell: Floats,
    weighted: Floats,
) -> None:
    """Compute the parts of the tangent at the quadrature points from the derivatives of U(J).

    Args:
        F: Deformation gradients, shape (m, 9, q); replaced by w U' F with the weights w [N m].
        gradients: Gradients dL_s/dX_p, shape (m, 4, 3) [1/m].
        weights: Weights w of the quadrature points, shape (m, q) [m^3].
        shapes: Derivatives dN_a/dL_s for the two s of `terms`, shape (a, 2, q).
        terms: The two barycentric coordinates in each node's shape function, shape (a, 2).
        mu: Shear modulus, shape (m,) [Pa].
        lame: Lame's first constant, shape (m,) [Pa].
        cof: Working memory, shape (9,).
        scratch: Working memory, shape (22, q).
        swell: Receives dJ/dx, shape (m, q, 3 a).
        weighted: Receives w U'' dJ/dx, shape (m, 3 a, q).
    """
    with cython.nogil:
        for e in range(len(F)):
            moduli_of_element(
                e, F, gradients, weights, shapes, terms, mu, lame, cof, scratch, swell, weighted
            )


def moduli_of_element(
    e: int,
    F: Floats,
    gradients: Floats,
    weights: Floats,
    shapes: Floats,
    terms: Ints,
    mu: Floats,
    lame: Floats,
    cof: Floats,
    scratch: Floats,
    swell: Floats,
    weighted: Floats,
) -> None:
    """Compute the result of `moduli` for element `e`; inner loops run over adjacent points."""
    points = F.shape[2]
    first_constant = lame[e]
    log_part = mu[e] + 0.5 * first_constant
    for q in range(points):
        det = cofactors(F, e, q, cof)
        w, inverse = weights[e, q], 1.0 / det
        first = w * (0.5 * first_constant * det - log_part * inverse)
        scratch[21, q] = w * (log_part * inverse * inverse + 0.5 * first_constant)
        for i in range(9):
            F[e, i, q] *= first
            scratch[i, q] = cof[i]
    for s in range(4):
        g0, g1, g2 = gradients[e, s, 0], gradients[e, s, 1], gradients[e, s, 2]
        for i in range(3):
            for q in range(points):
                scratch[9 + 3 * s + i, q] = (
                    g0 * scratch[3 * i, q] + g1 * scratch[3 * i + 1, q] + g2 * scratch[3 * i + 2, q]
                )
    for a in range(len(terms)):
        for i in range(3):
            s, t, k = 9 + 3 * terms[a, 0] + i, 9 + 3 * terms[a, 1] + i, 3 * a + i
            for q in range(points):
                slope = shapes[a, 0, q] * scratch[s, q] + shapes[a, 1, q] * scratch[t, q]
                weighted[e, k, q] = scratch[21, q] * slope
                swell[e, q, k] = slope


def turns(moments: Floats, normals: Floats, out: Floats) -> None:
    """Multiply integrals of w U' F by the cross products of the gradients of L_s and L_t.

    Args:
        moments: Integrals of w U' F L_c L_d over each element, shape (m, 9, r).
        normals: Cross products for the six pairs (s, t), shape (m, 6, 3) [1/m^2].
        out: Receives the products, shape (m, 3, r, 6) [N/m].
    """
    with cython.nogil:
        for e in range(len(moments)):
            for k in range(3):
                for r in range(moments.shape[2]):
                    for s in range(6):
                        out[e, k, r, s] = (
                            moments[e, 3 * k, r] * normals[e, s, 0]
                            + moments[e, 3 * k + 1, r] * normals[e, s, 1]
                            + moments[e, 3 * k + 2, r] * normals[e, s, 2]
                        )


def add_tangents(
    swell: Floats, turn: Floats, index: Ints, count: int, beyond: int, blocks: Floats
) -> None:
    """Add the elements' tangents to the blocks of the matrix.

    Args:
        swell: Part of the tangent with the second derivative U'', shape (m, 3 a, 3 a) [N/m].
        turn: Axial vectors of the part with U', one for each pair of nodes, shape
            (m, 3, a (a + 1) / 2) [N/m].
        index: Block of each pair of nodes (a, b), b <= a; -1 - block if the block is transposed;
            `beyond` if a node is fixed. Shape (m, a (a + 1) / 2).
        count: Number of nodes of an element.
        beyond: Number of blocks.
        blocks: Blocks of the matrix, shape (beyond, 9) [N/m].
    """
    with cython.nogil:
        for e in range(len(swell)):
            pair = 0
            for a in range(count):
                for b in range(a + 1):
                    k = index[e, pair]
                    t0, t1, t2 = turn[e, 0, pair], turn[e, 1, pair], turn[e, 2, pair]
                    pair += 1
                    if k == beyond:
                        continue
                    i, j = 3 * a, 3 * b
                    if k >= 0:
                        blocks[k, 0] += swell[e, i, j]
                        blocks[k, 1] += swell[e, i, j + 1] + t2
                        blocks[k, 2] += swell[e, i, j + 2] - t1
                        blocks[k, 3] += swell[e, i + 1, j] - t2
                        blocks[k, 4] += swell[e, i + 1, j + 1]
                        blocks[k, 5] += swell[e, i + 1, j + 2] + t0
                        blocks[k, 6] += swell[e, i + 2, j] + t1
                        blocks[k, 7] += swell[e, i + 2, j + 1] - t0
                        blocks[k, 8] += swell[e, i + 2, j + 2]
                    else:
                        k = -1 - k
                        blocks[k, 0] += swell[e, i, j]
                        blocks[k, 3] += swell[e, i, j + 1] + t2
                        blocks[k, 6] += swell[e, i, j + 2] - t1
                        blocks[k, 1] += swell[e, i + 1, j] - t2
                        blocks[k, 4] += swell[e, i + 1, j + 1]
                        blocks[k, 7] += swell[e, i + 1, j + 2] + t0
                        blocks[k, 2] += swell[e, i + 2, j] + t1
                        blocks[k, 5] += swell[e, i + 2, j + 1] - t0
                        blocks[k, 8] += swell[e, i + 2, j + 2]
