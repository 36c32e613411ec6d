"""Finer tetrahedra where a body is thin, and bends more than it is squeezed.

A plate is filled with one layer of elements, whose edges along it are as long as those of a bulky
body or longer. Squeezing needs few of them. Bending is cubic between two supports, and what
quadratic elements cannot follow makes a plate too stiff, by two terms (docs/decisions/0065):

    63 % (h / R)^2 (1 + (h / t)^2 / 22)

with edges up to h, on a clamped plate of radius R and thickness t. The first is the curvature that
changes within an element. The second is the shear that an element far longer than it is thick
cannot avoid as it bends, so that edges of thin sheets are shorter still.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.bisection import Bisected, with_shorter_edges
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.mesh.tetrahedra import TetMesh, boundary
from cohaptic_server.numeric import Floats, Ints

# Thickness of a thin part and its longest edge, as shares of the edge that is asked for. fTetWild's
# own are up to 1.9 times as long as asked for.
THIN, SHORT = 1.5, 0.75
# Up to so many times that thickness edges may be longer as a part is thicker: at twice it they are
# as long as fTetWild's own, and a shorter `--edge` never gives a coarser plate.
FADES = 2.0
_LOCKS = 1.0 / 22.0  # of (h / t)^2, over the first term
_SHORTEST = 0.35  # of the longest edge: the tip of a wedge has no thickness
_OPPOSED = -0.5  # cosine of 120 degrees, between the normals of the two sides
# Over the thickness, or over `THIN` where that is more: how far the middles of two opposed faces
# may be from each other, one of which lies up to half of an edge beside the place straight through.
_BESIDE = 1.1
_BATCH = 256  # faces whose neighbours are looked for together: 100 MB where all are neighbours


def finer_where_thin(tets: TetMesh, length: float, most: int) -> Bisected:
    """Split the long edges of thin parts.

    Args:
        tets: An object.
        length: Edge that was asked for [m].
        most: Tetrahedra that there may be; an object that has more has a fine mesh already.
    """
    thickness = np.full(len(tets.vertices), np.inf)
    if len(tets.tets) < most:
        thickness = layer_thickness(tets.vertices, boundary(tets.tets), FADES * THIN * length)
    return with_shorter_edges(tets, longest_wanted(thickness, length), most)


def longest_wanted(thickness: Floats, length: float) -> Floats:
    """The longest edge with which a part of some thickness bends well enough, shape (n,) [m].

    It has the error that an edge of `SHORT` has on a part of many times its thickness.

    Args:
        thickness: Shape (n,) [m]; infinite where a part is not thin.
        length: Edge that was asked for [m].
    """
    thin, wanted = np.isfinite(thickness), np.full(len(thickness), np.inf)
    t = thickness[thin]
    most = SHORT * length * np.maximum(1.0, t / (THIN * length))
    locks = 4.0 * _LOCKS * (most / np.maximum(t, 1e-9 * length)) ** 2
    # The root h of h^2 (1 + locks h^2 / (4 most^2)) = most^2.
    h = most * np.sqrt(2.0 / (1.0 + np.sqrt(1.0 + locks)))
    wanted[thin] = np.maximum(h, _SHORTEST * SHORT * length)
    return wanted


def layer_thickness(x: Floats, faces: Ints, most: float) -> Floats:
    """Thickness of a body at the vertices of faces behind which its other side is near, (n,) [m].

    Args:
        x: Vertices, shape (n, 3) [m].
        faces: Its surface, counter-clockwise from outside, shape (m, 3).
        most: Largest distance of the other side, along the normal of a face [m]; beyond it, and
            inside the body, the result is infinite.
    """
    from scipy.spatial import cKDTree  # takes 0.3 s, and only preparing an object needs it

    areas = face_area_vectors(x, faces)
    normals = areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)
    middles = x[faces].mean(axis=1)
    tree, least = cKDTree(middles), np.full(len(faces), np.inf)
    for start in range(0, len(faces), _BATCH):
        some = cKDTree(middles[start : start + _BATCH])
        pairs = some.sparse_distance_matrix(tree, _BESIDE * most, output_type="ndarray")
        a, b = pairs["i"] + start, pairs["j"]
        opposed = np.einsum("pi,pi->p", normals[a], normals[b]) < _OPPOSED
        a, b = a[opposed], b[opposed]
        # From one face to the other against its normal; where it is negative a narrow gap is
        # between.
        across = np.einsum("pi,pi->p", middles[a] - middles[b], normals[a])
        behind = (across > 0.0) & (across <= most)
        behind &= pairs["v"][opposed] <= _BESIDE * np.maximum(across, most / FADES)
        np.minimum.at(least, a[behind], across[behind])
    found = np.full(len(x), np.inf)
    np.minimum.at(found, faces.ravel(), np.repeat(least, 3))
    return found
