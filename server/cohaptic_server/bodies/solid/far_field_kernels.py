"""Loops over the samples of a far field; compiled where there is a compiler (`.pxd`).

All write into arrays of the caller, who answers for shapes and indices.
"""

from __future__ import annotations

from cohaptic_server.numeric import Floats, Ints, Narrow


def spread(near: Ints, carries: Floats, vertices: Ints, weights: Floats, out: Floats) -> bool:
    """Distribute a force to the samples.

    Args:
        near: Samples round each vertex, shape (n, k).
        carries: Their shares in a force on the vertex, shape (n, k).
        vertices: Under the force, shape (v,).
        weights: Share of the force on each, shape (v,).
        out: Receives the share of each sample, shape (m,).

    Returns:
        Whether all of the vertices exist; if not, `out` is incomplete.
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


def respond(compliance: Narrow, shares: Floats, sums: Narrow, out: Floats) -> int:
    """Displacement of the samples under forces on them along x, y, z.

    Args:
        compliance: G, three rows for each sample, shape (m, 9 m) [m/N].
        shares: Share of the force on each sample, shape (m,).
        sums: Room for sums in single precision, shape (9 m,).
        out: Receives displacement per unit force, shape (9 m,) [m/N].

    Returns:
        Number of samples with a share: those whose rows of G were read.
    """
    size = sums.shape[0]
    for j in range(size):
        sums[j] = 0.0
    # Four samples at a time, so that a sum is loaded and stored once for four of its terms.
    used = 0
    a = b = c = d = 0
    f = g = h = e = 0.0
    for p in range(shares.shape[0]):
        if shares[p] == 0.0:
            continue
        if used % 4 == 0:
            a, e = p, shares[p]
        elif used % 4 == 1:
            b, f = p, shares[p]
        elif used % 4 == 2:
            c, g = p, shares[p]
        else:
            d, h = p, shares[p]
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
        carries: Their shares in it, shape (n, k).
        vertices: Shape (v,).
        values: At the samples, shape (m, 3).
        out: Receives the values at the vertices, shape (v, 3).

    Returns:
        Whether all of the vertices exist; if not, `out` is incomplete.
    """
    for i in range(vertices.shape[0]):
        v = vertices[i]
        if v < 0 or v >= near.shape[0]:
            return False
        x = y = z = 0.0
        for j in range(near.shape[1]):
            share = carries[v, j]
            p = near[v, j]
            x += share * values[p, 0]
            y += share * values[p, 1]
            z += share * values[p, 2]
        out[i, 0] = x
        out[i, 1] = y
        out[i, 2] = z
    return True


def subtract(values: Floats, field: Floats, force: Floats, out: Floats) -> None:
    """Displacement of the samples without a force.

    Args:
        values: With it, shape (m, 3) [m].
        field: Displacement per unit force along x, y, z, shape (3, m, 3) [m/N].
        force: Shape (3,) [N].
        out: Receives the displacement without it, shape (m, 3) [m].
    """
    f, g, h = force[0], force[1], force[2]
    for p in range(values.shape[0]):
        for b in range(3):
            moved = f * field[0, p, b] + g * field[1, p, b] + h * field[2, p, b]
            out[p, b] = values[p, b] - moved


def between(spreads: Floats, fields: Floats, out: Floats) -> None:
    """Displacement of contacts by forces on contacts, by the far field alone.

    Args:
        spreads: Share of each sample in each contact, shape (c, m).
        fields: Displacement of the samples by each contact per unit force along x, y, z, shape
            (c, 3, m, 3) [m/N].
        out: Receives the displacement of contact i by a force on contact j, shape (c, c, 3, 3)
            [m/N]; the direction of the force first.
    """
    count = spreads.shape[0]
    for i in range(count):
        for j in range(count):
            for a in range(3):
                for b in range(3):
                    out[i, j, a, b] = 0.0
        for p in range(spreads.shape[1]):
            share = spreads[i, p]
            if share != 0.0:
                for j in range(count):
                    for a in range(3):
                        for b in range(3):
                            out[i, j, a, b] += share * fields[j, a, p, b]


def own_compliance(
    shares: Floats, normals: Floats, blocks: Floats, direction: Floats, normal: Floats
) -> float:
    """Mean of the samples' own compliance, each along `direction` turned from `normal` to its own.

    Args:
        shares: Share of each sample, shape (m,).
        normals: Of the samples, shape (m, 3).
        blocks: Compliance of each sample at itself, shape (m, 9) [m/N].
        direction: Unit vector, shape (3,).
        normal: Unit vector, shape (3,).

    Returns:
        Compliance [m/N].
    """
    total = 0.0
    dx, dy, dz = direction[0], direction[1], direction[2]
    nx, ny, nz = normal[0], normal[1], normal[2]
    for p in range(shares.shape[0]):
        if shares[p] == 0.0:
            continue
        mx, my, mz = normals[p, 0], normals[p, 1], normals[p, 2]
        cosine = mx * nx + my * ny + mz * nz
        ax, ay, az = ny * mz - nz * my, nz * mx - nx * mz, nx * my - ny * mx
        # Rodrigues' formula. Between opposite normals the rotation is not defined; samples of the
        # opposite side have almost no weight.
        scale = (ax * dx + ay * dy + az * dz) / max(1.0 + cosine, 1e-3)
        x = cosine * dx + ay * dz - az * dy + scale * ax
        y = cosine * dy + az * dx - ax * dz + scale * ay
        z = cosine * dz + ax * dy - ay * dx + scale * az
        total += shares[p] * (
            x * (blocks[p, 0] * x + blocks[p, 1] * y + blocks[p, 2] * z)
            + y * (blocks[p, 3] * x + blocks[p, 4] * y + blocks[p, 5] * z)
            + z * (blocks[p, 6] * x + blocks[p, 7] * y + blocks[p, 8] * z)
        )
    return total
