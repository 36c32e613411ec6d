"""Loops over the samples of a far field; compiled where there is a compiler (`.pxd`).

All functions write into arrays of the caller, who must ensure correct shapes and indices.
"""

from __future__ import annotations

from cohaptic_server.numeric import Floats, Ints, Narrow


def spread(near: Ints, carries: Floats, vertices: Ints, weights: Floats, out: Floats) -> bool:
    """Distribute a force on vertices to the samples round them.

    Args:
        near: Samples round each vertex, shape (n, k).
        carries: Share of each of these samples in a force on the vertex, shape (n, k).
        vertices: Vertices under the force, shape (v,).
        weights: Share of the force on each vertex, shape (v,).
        out: Receives the share of each of the m samples, shape (m,).

    Returns:
        Whether all vertices exist; if not, `out` is incomplete.
    """
    for p in range(out.shape[0]):
        out[p] = 0.0
    for i in range(vertices.shape[0]):
        v = vertices[i]
        if v < 0 or v >= near.shape[0]:
            return False
        for j in range(near.shape[1]):
            out[near[v, j]] += weights[i] * carries[v, j]
    return True


def respond(compliance: Narrow, fractions: Floats, sums: Narrow, out: Floats) -> int:
    """Compute the displacement of the samples by a force on them along x, y, and z.

    Args:
        compliance: Compliance G between samples, three rows for each sample, (m, 9 m) [m/N].
        fractions: Share of the force on each sample, shape (m,).
        sums: Working memory for sums in single precision, shape (9 m,).
        out: Receives the displacement per unit force, shape (9 m,) [m/N].

    Returns:
        Number of samples with a nonzero share, whose rows of G were read.
    """
    size = sums.shape[0]
    for j in range(size):
        sums[j] = 0.0
    # Four samples at a time, so that each sum is loaded and stored once per four terms.
    used = 0
    a = b = c = d = 0
    f = g = h = e = 0.0
    for p in range(fractions.shape[0]):
        if fractions[p] == 0.0:
            continue
        if used % 4 == 0:
            a, e = p, fractions[p]
        elif used % 4 == 1:
            b, f = p, fractions[p]
        elif used % 4 == 2:
            c, g = p, fractions[p]
        else:
            d, h = p, fractions[p]
            for j in range(size):
                sums[j] += (
                    e * compliance[a, j]
                    + f * compliance[b, j]
                    + g * compliance[c, j]
                    + h * compliance[d, j]
                )
        used += 1
    rest = used % 4
    if rest > 0:
        for j in range(size):
            sums[j] += e * compliance[a, j]
    if rest > 1:
        for j in range(size):
            sums[j] += f * compliance[b, j]
    if rest > 2:
        for j in range(size):
            sums[j] += g * compliance[c, j]
    for j in range(size):
        out[j] = sums[j]
    return used


def interpolate(near: Ints, carries: Floats, vertices: Ints, values: Floats, out: Floats) -> bool:
    """Interpolate a displacement of the samples at vertices.

    Args:
        near: Samples round each vertex, shape (n, k).
        carries: Share of each of these samples in the vertex's displacement, shape (n, k).
        vertices: Vertices to interpolate at, shape (v,).
        values: Values at the samples, shape (m, 3).
        out: Receives the values at the vertices, shape (v, 3).

    Returns:
        Whether all vertices exist; if not, `out` is incomplete.
    """
    for i in range(vertices.shape[0]):
        v = vertices[i]
        if v < 0 or v >= near.shape[0]:
            return False
        x = y = z = 0.0
        for j in range(near.shape[1]):
            fraction = carries[v, j]
            p = near[v, j]
            x += fraction * values[p, 0]
            y += fraction * values[p, 1]
            z += fraction * values[p, 2]
        out[i, 0] = x
        out[i, 1] = y
        out[i, 2] = z
    return True


def subtract(values: Floats, field: Floats, force: Floats, out: Floats) -> None:
    """Compute the displacement of the samples without one of the forces.

    Args:
        values: Displacement by all forces, shape (m, 3) [m].
        field: Displacement per unit force along x, y, z, shape (3, m, 3) [m/N].
        force: Force to leave out, shape (3,) [N].
        out: Receives the displacement without the force, shape (m, 3) [m].
    """
    f, g, h = force[0], force[1], force[2]
    for p in range(values.shape[0]):
        for b in range(3):
            moved = f * field[0, p, b] + g * field[1, p, b] + h * field[2, p, b]
            out[p, b] = values[p, b] - moved


def between(spreads: Floats, fields: Floats, out: Floats) -> None:
    """Compute the displacement of each contact by a unit force on each, by the far field alone.

    Args:
        spreads: Share of each sample in the force on each contact, shape (c, m).
        fields: Displacement of the samples by each contact per unit force along x, y, z, shape
            (c, 3, m, 3) [m/N].
        out: Receives the displacement of contact i by a force on contact j; the third axis is the
            direction of the force, shape (c, c, 3, 3) [m/N].
    """
    count = spreads.shape[0]
    for i in range(count):
        for j in range(count):
            for a in range(3):
                for b in range(3):
                    out[i, j, a, b] = 0.0
        for p in range(spreads.shape[1]):
            fraction = spreads[i, p]
            if fraction != 0.0:
                for j in range(count):
                    for a in range(3):
                        for b in range(3):
                            out[i, j, a, b] += fraction * fields[j, a, p, b]


def own_compliance(blocks: Floats, vertices: Ints, weights: Floats, direction: Floats) -> float:
    """Compute a contact's self-compliance as a mean over contacts at the vertices under it.

    A vertex counts with the fourth power of its weight. The vertices near the centre of the
    pressure dominate, because the compliance may change much within a contact, and vertices that
    a finger slides onto come in gradually.

    Args:
        blocks: Self-compliance of a contact centred at each vertex, shape (n, 9) [m/N].
        vertices: Vertices under the contact, shape (v,).
        weights: Share of the force on each vertex, shape (v,).
        direction: Unit vector of the force, shape (3,).

    Returns:
        Compliance [m/N], never negative; -1 if a vertex does not exist.
    """
    total = whole = 0.0
    x, y, z = direction[0], direction[1], direction[2]
    for i in range(vertices.shape[0]):
        v = vertices[i]
        if v < 0 or v >= blocks.shape[0]:
            return -1.0
        fraction = weights[i] * weights[i] * weights[i] * weights[i]
        whole += fraction
        total += fraction * (
            x * (blocks[v, 0] * x + blocks[v, 1] * y + blocks[v, 2] * z)
            + y * (blocks[v, 3] * x + blocks[v, 4] * y + blocks[v, 5] * z)
            + z * (blocks[v, 6] * x + blocks[v, 7] * y + blocks[v, 8] * z)
        )
    return max(0.0, total / whole) if whole > 0.0 else 0.0
