"""Loops that compute the fields of loads, compliances, and each user's free surface."""

from __future__ import annotations

from cohaptic_server.numeric import Floats, Ints, Narrow

# Uncompiled, `superpose` takes a thousand times as long as numpy takes, copies included.
COMPILED = not __file__.endswith(".py")


def superpose(
    C: Narrow,
    starts: Ints,
    ends: Ints,
    vertices: Ints,
    weights: Floats,
    directions: Floats,
    fields: Floats,
) -> None:
    """Compute the field of each load: the displacement of every vertex per unit of that force.

    Args:
        C: Compliance of all vertices, symmetric, shape (3 n, 3 n) [m/N].
        starts, ends: First index of each load in `vertices` and `weights`, and the index after its
            last one, shape (c,) each.
        vertices: Vertices under the pressures of the loads, load after load, shape (k,).
        weights: Share of a load's force on each vertex, shape (k,).
        directions: Unit vector of each load, shape (c, 3).
        fields: Receives the fields, shape (c, 3 n) [m/N].
    """
    for i in range(fields.shape[0]):
        for j in range(fields.shape[1]):
            fields[i, j] = 0.0
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        k = starts[i]
        # Two vertices (six rows) per pass: the field is read and written half as often.
        while k + 1 < ends[i]:
            a, b = 3 * vertices[k], 3 * vertices[k + 1]
            ax, ay, az = weights[k] * x, weights[k] * y, weights[k] * z
            bx, by, bz = weights[k + 1] * x, weights[k + 1] * y, weights[k + 1] * z
            for j in range(fields.shape[1]):
                one = ax * C[a, j] + ay * C[a + 1, j] + az * C[a + 2, j]
                fields[i, j] += one + (bx * C[b, j] + by * C[b + 1, j] + bz * C[b + 2, j])
            k += 2
        if k < ends[i]:
            a = 3 * vertices[k]
            ax, ay, az = weights[k] * x, weights[k] * y, weights[k] * z
            for j in range(fields.shape[1]):
                fields[i, j] += ax * C[a, j] + ay * C[a + 1, j] + az * C[a + 2, j]


def seen_by(
    fields: Floats,
    starts: Ints,
    ends: Ints,
    vertices: Ints,
    weights: Floats,
    directions: Floats,
    C: Floats,
) -> None:
    """Compute the compliance matrix: the displacement of each contact per unit force of each load.

    Args:
        fields: Fields of the loads, shape (c, 3 n) [m/N].
        starts, ends: As in `superpose`.
        vertices: As in `superpose`.
        weights: As in `superpose`.
        directions: As in `superpose`; a contact's displacement counts along its own direction.
        C: Receives the compliances, C[displaced contact, load], shape (c, c) [m/N].
    """
    for i in range(C.shape[0]):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        for j in range(C.shape[1]):
            moved = 0.0
            for k in range(starts[i], ends[i]):
                a = 3 * vertices[k]
                along = x * fields[j, a] + y * fields[j, a + 1] + z * fields[j, a + 2]
                moved += weights[k] * along
            C[i, j] = moved


def subtract_own(
    displacement: Floats,
    fields: Floats,
    spans: Ints,
    forces: Floats,
    starts: Ints,
    vertices: Ints,
    left: Floats,
) -> None:
    """Compute the displacement of some vertices for each user, without the loads of that user.

    Args:
        displacement: Displacement of every vertex under all loads, shape (n, 3) [m].
        fields: Fields of the loads, shape (c, n, 3) [m/N].
        spans: First load of each of u users, then the end of the last user's loads, (u + 1,).
        forces: Forces to leave out, one for each load from load spans[0] on; loads beyond the last
            force stay, shape (l,) [N].
        starts: Start of each user's part of `vertices`, then the end of the last part, (u + 1,).
        vertices: Vertices at which the displacement is computed, user after user, shape (k,).
        left: Receives the displacement, shape (k, 3) [m].
    """
    for user in range(starts.shape[0] - 1):
        first, last = spans[user], min(spans[user + 1], spans[0] + forces.shape[0])
        for k in range(starts[user], starts[user + 1]):
            v = vertices[k]
            for axis in range(3):
                left[k, axis] = displacement[v, axis]
            for i in range(first, last):
                force = forces[i - spans[0]]
                for axis in range(3):
                    left[k, axis] -= force * fields[i, v, axis]
