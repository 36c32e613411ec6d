"""Finds the closed parts that each tetrahedron lies in, and checks the volume of each part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.fix_mesh import inside
from cohaptic_server.objects.parts.parts import Parts, PartSurface
from cohaptic_server.objects.parts.volume_lost import MAX_VOLUME_LOSS, VolumeLostError


def members(surfaces: Sequence[PartSurface], tets: TetMesh) -> npt.NDArray[np.bool_]:
    """Whether each tetrahedron lies within each closed surface, shape (parts, m).

    Filling keeps every surface, so that no surface passes through a tetrahedron: its middle shows
    where it lies. A tetrahedron in no other part is put into the largest one, since filling moves
    surfaces slightly, and next to them a middle may lie in no part.

    Args:
        surfaces: Surfaces of the parts [m].
        tets: Tetrahedra that fill all surfaces.
    """
    middles = tets.vertices[tets.tets].mean(axis=1)
    largest = int(sizes(surfaces).argmax())
    found = np.zeros((len(surfaces), len(middles)), dtype=np.bool_)
    for k, surface in enumerate(surfaces):
        if k != largest:
            found[k] = inside(surface.x, surface.faces, middles)
    elsewhere = np.flatnonzero(found.any(axis=0))
    found[largest] = True
    found[largest, elsewhere] = inside(
        surfaces[largest].x, surfaces[largest].faces, middles[elsewhere]
    )
    return found


def innermost(surfaces: Sequence[PartSurface], within: npt.NDArray[np.bool_]) -> Parts:
    """Part of each tetrahedron: of all parts that contain it, the one with the least volume.

    Args:
        within: Result of `members`, shape (parts, m).

    Raises:
        VolumeLostError: A part has no tetrahedron.
    """
    of = np.full(within.shape[1], -1, dtype=np.int64)
    for k in np.argsort(-sizes(surfaces), kind="stable").tolist():
        of[within[k]] = k
    names = tuple(surface.name for surface in surfaces)
    empty = [name for k, name in enumerate(names) if not (of == k).any()]
    if empty:
        raise VolumeLostError(
            f"no tetrahedron belongs to {', '.join(empty)}",
            ": smaller parts cover it, or it is too thin for elements of this --edge",
            empty[0],
        )
    return Parts(names, of)


def check_volumes(names: Sequence[str], found: Floats, wanted: Floats) -> None:
    """Refuse tetrahedra if those of some part differ too much from its volume.

    Args:
        found: Volume of the tetrahedra of each part, shape (parts,) [m^3].
        wanted: Volume that each part should have, shape (parts,) [m^3].

    Raises:
        VolumeLostError: A part has lost, or gained, more than `MAX_VOLUME_LOSS` of its volume.
    """
    for name, share in zip(names, (found / wanted).tolist(), strict=True):
        if abs(share - 1.0) > MAX_VOLUME_LOSS:
            raise VolumeLostError(
                f"the tetrahedra of {name} have {share:.0%} of its volume",
                ": it is too thin for elements of this size. Take a smaller --edge, or what there"
                " is with --repair",
                name,
            )


def sizes(surfaces: Sequence[PartSurface]) -> Floats:
    """Volume that each surface encloses, shape (parts,)."""
    return np.array([abs(volume(one.x - one.x.mean(axis=0), one.faces)) for one in surfaces])
