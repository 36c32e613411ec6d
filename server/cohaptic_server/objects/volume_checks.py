"""Mends and checks the tetrahedra of a file, as the triangles of a surface are checked.

Programs write a volume mesh with points of its own for every cell, with an element once for each
group that has it, or inside out: these are mended, and said. A mesh whose faces do not fit together
has cracks, or hangs together by an edge or a corner about which its pieces turn without a force;
each is refused with its place in the unit of the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import boundary, face_pieces, pieces, volumes
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.objects.memory_limit import named, say_once
from cohaptic_server.objects.surface.checks import intersecting
from cohaptic_server.objects.surface.surface_file import equal_points

# Distance at which two points are one, as a share of the size: files in single precision have 24
# bits, and the shortest edge of a useful mesh is ten thousand times as long.
SAME = 1e-7
_LARGEST = 0.8  # share of the volume; a piece with more may be taken alone
# Counter-clockwise from outside.
_FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def mended(path: Path, x: Floats, tets: Ints) -> tuple[Floats, Ints, Ints]:
    """Merge points at one place, drop repeated tetrahedra, and turn those that are inside out.

    Args:
        path: The file, for what is said.
        x: Vertices, shape (n, 3), each of which is used.
        tets: Vertices of each tetrahedron, shape (m, 4).

    Returns:
        Vertices; tetrahedra, shape (k, 4); and the index of each among those given, shape (k,).
    """
    first, inverse = equal_points(x, SAME)
    # Two near points may lie in two cells of a grid; those of a grid that is shifted are one.
    again, place = equal_points(x[first], SAME, shift=0.5)
    first, inverse = first[again], place[inverse]
    if len(first) < len(x):
        count = f"{len(x) - len(first):,} points lie at the place of another one"
        say_once(path, f"{count} (within {SAME:g} of its size) and are merged with it")
        x, tets = x[first], inverse[tets]
    _, once = np.unique(np.sort(tets, axis=1), axis=0, return_index=True)
    once.sort()
    if len(once) < len(tets):
        count = f"{len(tets) - len(once):,} tetrahedra are there more than once"
        say_once(path, f"{count}, as in several groups: each counts once, in its first group")
    tets = tets[once]
    inside_out = volumes(x, tets) < 0.0
    if inside_out.any() and not inside_out.all():  # a whole mesh in the other order is usual
        count = f"{inside_out.sum():,} of {len(tets):,}"
        say_once(path, f"{count} tetrahedra are inside out and are turned")
    tets[inside_out] = tets[inside_out][:, [0, 2, 1, 3]]
    return x, tets, once


class PiecesError(BodyError):
    """The tetrahedra of a file are in pieces that do not hold together by faces.

    Args:
        problem: The fault, as the beginning of a sentence.
        advice: What can be done, as another sentence.

    Attributes:
        problem: The fault, as the beginning of a sentence.
    """

    def __init__(self, path: Path, problem: str, advice: str) -> None:
        super().__init__(f"{path}: {problem}. {advice}")
        self.problem = problem


def largest_alone(path: Path, x: Floats, tets: Ints) -> Ints:
    """Indices of the tetrahedra in the piece with over `_LARGEST` of the volume, shape (k,).

    Small pieces that share no face with it are left out, and said. If no piece is so large, all
    tetrahedra are kept.
    """
    fraction, of = _pieces(x, tets)
    largest = int(fraction.argmax())
    if len(fraction) == 1 or fraction[largest] <= _LARGEST:
        return np.arange(len(tets))
    left = f"{len(fraction) - 1} of {len(fraction)} pieces"
    say_once(path, f"{left}, with {1.0 - fraction[largest]:.2%} of the volume, are left out")
    return np.flatnonzero(of == largest)


def _pieces(x: Floats, tets: Ints) -> tuple[Floats, Ints]:
    """Share of the volume of each piece that holds together by faces; piece of each element."""
    of = face_pieces(tets)
    each = np.bincount(of, np.abs(volumes(x, tets)))
    return each / each.sum(), of


def check_conforming(path: Path, x: Floats, tets: Ints) -> None:
    """Refuse tetrahedra that do not fit together face to face.

    Raises:
        PiecesError: They are in several pieces, which may hang together by an edge or a corner.
        BodyError: A face has more than two tetrahedra, or two on one side of it; or faces lie on
            one another without being one. The error names the place.
    """
    faces = tets[:, _FACES].reshape(-1, 3)
    each, inverse, counts = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    if (counts > 2).any():
        raise BodyError(
            f"{path}: {(counts > 2).sum():,} faces have three tetrahedra or more, so they overlap;"
            f" one is {_at(x[each[counts > 2][0]])}. Mesh the object anew"
        )
    # Two tetrahedra that lie on both sides of their face turn it in opposite senses.
    turns = np.bincount(inverse.reshape(-1), _turn(faces), len(each))
    folded = (counts == 2) & (turns != 0.0)
    if folded.any():
        raise BodyError(
            f"{path}: {folded.sum():,} faces have both of their tetrahedra on one side, so these"
            f" overlap, as after a vertex was moved through a face; one is"
            f" {_at(x[each[folded][0]])}. Mesh the object anew"
        )
    fraction, of = _pieces(x, tets)
    if len(fraction) > 1:
        largest = fraction.max()
        alone = f", or take the largest alone, {largest:.1%} of it, with --repair"
        advice = f"Join them by faces{alone if largest > _LARGEST else ', or take one of them out'}"
        hinge = _shared(tets, of == of[0])
        if pieces(tets, len(x)).max() > 0:
            problem = f"the solid is in {len(fraction)} pieces, and it must be one"
        else:
            problem = (
                f"its {len(fraction)} pieces hang together by edges or corners only, about which"
                f" they would turn without a force; one is {_at(x[hinge[:1]])}"
            )
        raise PiecesError(path, problem, advice)
    outside = boundary(tets)
    with named(path):
        crossing = intersecting(x - x.mean(axis=0), outside)
    if crossing.any():
        raise BodyError(
            f"{path}: {crossing.sum():,} faces cross others or lie on them without being shared, as"
            " where two meshes of different fineness meet: the solid would have cracks there; one"
            f" is {_at(x[outside[np.flatnonzero(crossing)[0]]])}. Mesh the parts together"
        )


def _turn(faces: Ints) -> Floats:
    """1 where the vertices of a face are an even permutation of their order, else -1, (m,)."""
    a, b, c = faces.T
    return np.where((a < b) ^ (b < c) ^ (a < c), 1.0, -1.0)


def _shared(tets: Ints, one: Mask) -> Ints:
    """Vertices that the tetrahedra of one piece share with those of others."""
    return np.intersect1d(tets[one], tets[~one])


def _at(points: Floats) -> str:
    x, y, z = points.mean(axis=0).tolist()
    return f"at ({x:.4g}, {y:.4g}, {z:.4g})"
