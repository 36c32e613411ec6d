"""Fills a closed surface with tetrahedra, by fTetWild (Hu et al. 2020) through pytetwild.

fTetWild also accepts surfaces with defects. It remeshes the surface: the boundary of the
tetrahedra lies within `envelope` of the input surface.
"""

from __future__ import annotations

import contextlib
import tempfile

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import TetMesh, pieces, volumes
from cohaptic_server.numeric import Floats, Ints

ENVELOPE = 1e-3  # share of the bounding box's diagonal, for edges up to 0.05 of it
_MAX_ENVELOPE = 0.04  # share of the diagonal
_MOST = 0.8  # share of the volume; crumbs beside a piece that has more may be left out


def envelope(edge: float) -> float:
    """Allowed distance between input and output surface, as a share of the diagonal.

    The distance between a chord and a curved surface grows with the square of the chord's length.
    A narrower envelope would force small tetrahedra at every bend, however long the edges may be.

    Args:
        edge: Target edge length, as a share of the diagonal.
    """
    return min(_MAX_ENVELOPE, ENVELOPE * max(1.0, (edge / 0.05) ** 2))


def tetrahedralise(x: Floats, faces: Ints, edge: float, *, largest: bool = False) -> TetMesh:
    """Fill a surface with tetrahedra.

    Args:
        x: Vertices of the surface, shape (n, 3) [m].
        faces: Triangles of the surface, shape (m, 3).
        edge: Target edge length, as a share of the bounding box's diagonal.
        largest: Of several pieces keep the one that has most of the volume, if one has.

    Raises:
        BodyError: pytetwild is not installed, or returned no tetrahedron, or several pieces.
    """
    try:
        from pytetwild.pytetwild import tetrahedralize
    except ImportError as error:
        raise BodyError(
            "filling a surface with tetrahedra needs pytetwild; install it with:"
            " pip install 'cohaptic[objects]'"
        ) from error
    # One thread: another core may be at work for users. fTetWild does not make the same mesh twice
    # (a torus had 2,463 to 2,648 tetrahedra in four runs), which is why the store keeps it.
    # pytetwild leaves a file in the working folder.
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
        vertices, found = tetrahedralize(
            x,
            np.asarray(faces, dtype=np.int32),
            edge_length_fac=edge,
            epsilon=envelope(edge),
            num_threads=1,
            quiet=True,
        )
    if not len(found):
        raise BodyError("no tetrahedron fits inside the surface: is there an inside?")
    x, tets = np.asarray(vertices, dtype=np.float64), np.asarray(found, dtype=np.int64)
    return TetMesh.checked(x, largest_piece(x, tets) if largest else tets)


def largest_piece(x: Floats, tets: Ints) -> Ints:
    """The tetrahedra of the piece with most of the volume; all of them if none has.

    Args:
        x: Vertices, shape (n, 3).
        tets: Shape (m, 4).
    """
    piece = pieces(tets, len(x))[tets[:, 0]]
    volume = np.bincount(piece, np.abs(volumes(x, tets)))
    most = int(volume.argmax())
    return tets[piece == most] if volume[most] > _MOST * volume.sum() else tets
