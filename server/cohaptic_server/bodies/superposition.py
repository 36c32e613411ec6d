"""What contacts see of the fields of loads, and a field without some of the loads."""

from __future__ import annotations

from cohaptic_server.numeric import Floats, Ints, Narrow

# As plain Python `combine` takes a thousand times as long as numpy, with its copy, does.
COMPILED = not __file__.endswith(".py")


def combine(rows: Narrow, vertices: Ints, weights: Floats, combined: Floats) -> None:
    """The weighted sum of some rows, `weights @ rows[vertices]`, without a copy of the rows.

    Args:
        rows: Shape (n, m).
        vertices: Numbers of the rows, shape (k,).
        weights: Shape (k,).
        combined: Set to the sum, shape (m,).
    """
    for j in range(combined.shape[0]):
        combined[j] = 0.0
    k = 0
    # Four rows in one pass: the sum is read and written a quarter as often.
    while k + 3 < vertices.shape[0]:
        a, b, c, d = vertices[k], vertices[k + 1], vertices[k + 2], vertices[k + 3]
        wa, wb, wc, wd = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
        for j in range(combined.shape[0]):
            pair = wc * rows[c, j] + wd * rows[d, j]
            combined[j] += wa * rows[a, j] + wb * rows[b, j] + pair
        k += 4
    while k < vertices.shape[0]:
        a = vertices[k]
        wa = weights[k]
        for j in range(combined.shape[0]):
            combined[j] += wa * rows[a, j]
        k += 1


def seen_by(fields: Floats, vertices: Ints, weights: Floats, direction: Floats, C: Floats) -> None:
    """Displacement of a contact along a direction by each load.

    Args:
        fields: Of the loads, shape (c, n, 3) [m/N].
        vertices: Under the contact's pressure, shape (k,).
        weights: Share of the force on each, shape (k,).
        direction: Unit vector, shape (3,).
        C: Set to the compliances, shape (c,) [m/N].
    """
    x, y, z = direction[0], direction[1], direction[2]
    for i in range(fields.shape[0]):
        moved = 0.0
        for k in range(vertices.shape[0]):
            v = vertices[k]
            moved += weights[k] * (x * fields[i, v, 0] + y * fields[i, v, 1] + z * fields[i, v, 2])
        C[i] = moved


def subtract(
    displacement: Floats,
    fields: Floats,
    first: int,
    forces: Floats,
    vertices: Ints,
    left: Floats,
) -> None:
    """Displacement of some vertices without some of the loads.

    Args:
        displacement: Of every vertex under all loads, shape (n, 3) [m].
        fields: Of the loads, shape (c, n, 3) [m/N].
        first: First load to leave out.
        forces: Of the loads to leave out, in order, shape (l,) [N].
        vertices: Shape (k,).
        left: Set to the displacement, shape (k, 3) [m].
    """
    for k in range(vertices.shape[0]):
        v = vertices[k]
        for axis in range(3):
            left[k, axis] = displacement[v, axis]
        for i in range(forces.shape[0]):
            for axis in range(3):
                left[k, axis] -= forces[i] * fields[first + i, v, axis]
