"""From a closed surface to tetrahedra, by fTetWild (Hu et al. 2020) through pytetwild.

It works in floating point within an envelope of the surface and never fails on a dirty one; the
surface that comes out is its own, within `envelope` of the one that went in.
"""

from __future__ import annotations

import contextlib
import tempfile

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints

ENVELOPE = 1e-3  # of the diagonal of the box around the surface, for edges of 0.05 of it
_WIDEST = 0.04


def envelope(edge: float) -> float:
    """How far off the surface may be, as a share of the diagonal, for edges that long.

    A chord leaves a round surface by the square of its length. Within a narrower envelope a longer
    edge would still get the many small tetrahedra that follow every bend.
    """
    return min(_WIDEST, ENVELOPE * max(1.0, (edge / 0.05) ** 2))


def fill(x: Floats, faces: Ints, edge: float) -> TetMesh:
    """Tetrahedra inside a surface.

    Args:
        x: Shape (n, 3) [m].
        faces: Shape (m, 3).
        edge: Length of an edge wanted, as a share of the diagonal of the box.

    Raises:
        BodyError: pytetwild is not there, or nothing came out.
    """
    try:
        from pytetwild.pytetwild import tetrahedralize
    except ImportError as error:
        raise BodyError(
            "filling a surface with tetrahedra needs pytetwild; install it with:"
            " pip install 'cohaptic[objects]'"
        ) from error
    # One thread: with several of them the mesh differs from run to run.
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
        # It leaves a file of its own in the folder that it runs in.
        vertices, tets = tetrahedralize(
            x,
            np.asarray(faces, dtype=np.int32),
            edge_length_fac=edge,
            epsilon=envelope(edge),
            num_threads=1,
            quiet=True,
        )
    if not len(tets):
        raise BodyError("no tetrahedron fits inside the surface: is there an inside?")
    return TetMesh.checked(np.asarray(vertices, dtype=np.float64), np.asarray(tets, dtype=np.int64))
