"""Fills a closed surface with tetrahedra, by fTetWild (Hu et al. 2020) through pytetwild.

fTetWild also accepts surfaces with defects. It remeshes the surface: the boundary of the
tetrahedra lies within `envelope` of the input surface.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import TetMesh, face_pieces, pieces, volumes
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.fill_process import fill
from cohaptic_server.objects.fix_surface import inside

FINEST = 0.05  # edge, as a share of the box's diagonal; shorter edges have the same envelope
ENVELOPE = 1e-3  # envelope for edges up to `FINEST`, as a share of the diagonal
_MAX_ENVELOPE = 0.04  # largest envelope, as a share of the diagonal
# Energy of the worst element (AMIPS; a regular one has 3) at which fTetWild stops. Where sheets
# cross or stick together some elements stay worse than 10, and fTetWild refines everything around
# them again and again: twenty crossing cubes became 78,000 tetrahedra with 10, and 23,000 with 30.
# The worst of the latter still has a hundredth of a regular element's volume.
_WORST, _WORST_OF_CROSSING = 10.0, 30.0
# Distance from the origin, in lengths of the object, from which the object is moved for filling:
# fTetWild kept 77 % of a ball that lay 5e6 lengths away, and all of one at 5e4.
_FAR = 1e3
_LARGEST = 0.8  # share of the volume; if one piece has more, all other pieces may be left out
# Share of the volume below which a crumb that is joined only at a corner or an edge is left out: it
# would turn about these without a force. Where sheets of a scan cross, two crumbs of 0.0005 arose.
_CRUMB = 0.01


class NothingFitsError(BodyError):
    """No tetrahedron fits into a surface that encloses nothing or is thinner than the envelope."""


def envelope(edge: float) -> float:
    """Allowed distance between the input and the output surface, as a share of the diagonal.

    The distance between a chord and a curved surface grows with the square of the chord's length.
    A narrower envelope would force small tetrahedra at every bend, however long the edges may be.

    Args:
        edge: Target edge length, as a share of the bounding box's diagonal.
    """
    return min(_MAX_ENVELOPE, ENVELOPE * max(1.0, (edge / FINEST) ** 2))


def tetrahedralise(
    x: Floats,
    faces: Ints,
    edge: float,
    *,
    largest: bool = False,
    crossing: bool = False,
    within: tuple[Floats, Ints] | None = None,
    blur: float = 0.0,
    memory: float = math.inf,
    seconds: float = math.inf,
    progress: Callable[[float], None] = lambda fraction: None,
) -> TetMesh:
    """Fill a surface with tetrahedra.

    Args:
        x: Vertices of the surface, shape (n, 3) [m].
        faces: Triangles of the surface, shape (m, 3).
        edge: Target edge length, as a share of the bounding box's diagonal.
        largest: Whether to keep only the largest of several pieces, if it has most of the volume.
        crossing: Whether the surface passes through itself; worse elements are then accepted.
        within: Vertices and triangles of a closed surface; only tetrahedra inside it are kept.
            None keeps every tetrahedron that the filled surface encloses.
        blur: Uncertainty of the surface's position [m]; the envelope is at least this wide.
        memory: Limit of the memory for filling [bytes].
        seconds: Limit of the time for filling [s].
        progress: Called with the share that is done.

    Raises:
        FillLimitError: Filling takes more memory or time.
        NothingFitsError: pytetwild returned no tetrahedron.
        BodyError: pytetwild is not installed, or returned several pieces.
    """
    if importlib.util.find_spec("pytetwild") is None:
        raise BodyError(
            "filling a surface with tetrahedra needs pytetwild; install it with:"
            " pip install 'cohaptic[objects]'"
        )
    # fTetWild does not make the same mesh twice, which is why the store keeps it: a shuffle is
    # seeded from the system's random numbers, and no option sets that seed.
    known = min(_MAX_ENVELOPE, blur / float(np.linalg.norm(np.ptp(x, axis=0))))
    options = {
        "edge_length_fac": edge,
        "epsilon": max(envelope(edge), known),
        "stop_energy": _WORST_OF_CROSSING if crossing else _WORST,
    }
    if within is not None:
        options["disable_filtering"] = True
    away = _far_origin(x)
    filled, tets = fill(x - away, faces, options, memory=memory, seconds=seconds, progress=progress)
    x = filled + away
    if within is not None:
        tets = tets[inside(*within, x[tets].mean(axis=1))]
    if not len(tets):
        raise NothingFitsError("no tetrahedron fits inside the surface: is there an inside?")
    return TetMesh.checked(x, largest_piece(x, tets) if largest else tets)


def _far_origin(x: Floats) -> Floats:
    """Return the middle of an object far from the origin, and zero for any other, shape (3,)."""
    low, high = x.min(axis=0), x.max(axis=0)
    is_far = float(np.abs(x).max()) > _FAR * float((high - low).max())
    return 0.5 * (low + high) if is_far else np.zeros(3)


def largest_piece(x: Floats, tets: Ints) -> Ints:
    """Tetrahedra of the piece with over `_LARGEST` of the volume; of all pieces if there is none.

    Crumbs that share no face with the rest of their piece are left out in both cases.

    Args:
        x: Vertices, shape (n, 3).
        tets: Vertices of each tetrahedron, shape (m, 4).
    """
    piece = pieces(tets, len(x))[tets[:, 0]]
    volume = np.bincount(piece, np.abs(volumes(x, tets)))
    largest = int(volume.argmax())
    kept = tets[piece == largest] if volume[largest] > _LARGEST * volume.sum() else tets
    part = face_pieces(kept)
    fraction = np.bincount(part, np.abs(volumes(x, kept))) / volume.sum()
    large = fraction[part] > _CRUMB
    return kept[large] if large.any() else kept
