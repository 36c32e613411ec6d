"""Merges vertices of a triangle surface at the same coordinates."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints


def merge_vertices(x: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Merge vertices at the same coordinates, and drop triangles that then repeat a vertex.

    STL stores three separate vertices for every triangle; GLB and OBJ cut a surface along seams.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
    """
    size = float(np.ptp(x, axis=0).max()) or 1.0
    key = np.round(x / (1e-8 * size)).astype(np.int64)
    first, inverse = _unique_rows(key)
    faces = inverse[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    used, renumbered = np.unique(faces, return_inverse=True)
    return x[first][used], np.asarray(renumbered.reshape(-1, 3), dtype=np.int64)


def _unique_rows(key: Ints) -> tuple[Ints, Ints]:
    """Index of the first row in each set of equal rows, (k,), and the set of each row, (n,)."""
    # Odd constants of xxHash64; products modulo 2^64 spread the bits of a row over one number.
    odd = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
    # Sorting one number for each row is twenty times as fast as sorting rows.
    mixed = (key.astype(np.uint64) * odd).sum(axis=1, dtype=np.uint64)
    _, first, inverse = np.unique(mixed, return_index=True, return_inverse=True)
    if (key[first][inverse] != key).any():  # a hash collision
        _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return np.asarray(first), np.asarray(inverse).reshape(-1)
