"""Parts from closed surfaces: the nodes of a scene, and the tetrahedra that lie in each part.

For each tetrahedron the closed parts that contain it are found, and the volume of each part is
checked. The closed nodes of a GLB or glTF scene are read as parts with materials of their own.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.fix_surface import inside
from cohaptic_server.objects.parts.parts import (
    MAX_PARTS,
    MAX_VOLUME_LOSS,
    Parts,
    PartSurface,
    VolumeLostError,
    distinct,
)
from cohaptic_server.objects.surface.checks import edge_counts, is_flat
from cohaptic_server.objects.surface.gltf import Node, read_nodes
from cohaptic_server.objects.surface.surface_file import (
    SCENES,
    as_one,
    joined,
    merge_vertices,
    read_surface,
)


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
    for name, fraction in zip(names, (found / wanted).tolist(), strict=True):
        if abs(fraction - 1.0) > MAX_VOLUME_LOSS:
            raise VolumeLostError(
                f"the tetrahedra of {name} have {fraction:.0%} of its volume",
                ": it is too thin for elements of this size. Take a smaller --edge, or what there"
                " is with --repair",
                name,
            )


def sizes(surfaces: Sequence[PartSurface]) -> Floats:
    """Volume that each surface encloses, shape (parts,)."""
    return np.array([abs(volume(one.x - one.x.mean(axis=0), one.faces)) for one in surfaces])


def read_surfaces(path: Path) -> tuple[PartSurface, ...]:
    """Read the surfaces of a file: a single one without a name, or those of several parts.

    Args:
        path: A file of one of `SURFACES`.

    Raises:
        BodyError: `read_surface` refuses the file.
    """
    if path.suffix.lower() not in SCENES:
        return (PartSurface("", *read_surface(path)),)
    nodes = read_nodes(path)
    whole = joined(path, nodes)
    return closed_nodes(nodes) or (PartSurface("", *whole),)


def _closed(x: Floats, faces: Ints) -> tuple[Floats, Ints] | None:
    """The surface with equal vertices merged; None if it is not closed, or lies in a plane."""
    x, faces = merge_vertices(x, faces)
    closed = len(faces) > 0 and (edge_counts(faces) == 2).all() and not is_flat(x, faces)
    return (x, faces) if closed else None


def closed_nodes(nodes: Sequence[Node]) -> tuple[PartSurface, ...]:
    """Nodes of a scene as parts; empty unless there are several nodes, all of them closed.

    A scene with an open node, or with very many nodes, is taken for one surface that was stored in
    pieces.
    """
    if not 2 <= len(nodes) <= MAX_PARTS:
        return ()
    found: list[PartSurface] = []
    for _, group in itertools.groupby(nodes, key=lambda node: node.number):
        primitives = list(group)
        closed = [_closed(node.x, node.faces) for node in primitives]
        if len(primitives) > 1 and None not in closed:
            names_of = [f"{node.name} {node.material}".strip() for node in primitives]
        else:  # a mesh may be cut into primitives where its materials meet
            closed, names_of = [_closed(*as_one(primitives))], [primitives[0].name]
        for name, surface in zip(names_of, closed, strict=True):
            if surface is None:
                return ()
            found.append(PartSurface(name, *surface))
    if len(found) < 2:
        return ()
    names = distinct([surface.name or "node" for surface in found])
    return tuple(one._replace(name=name) for name, one in zip(names, found, strict=True))
