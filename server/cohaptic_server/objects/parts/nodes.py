"""The closed nodes of a scene, of a GLB file: parts with materials of their own."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic_server.objects.memory_limit import reading_limited
from cohaptic_server.objects.object_file import MAX_READ
from cohaptic_server.objects.parts.parts import MAX_PARTS, PartSurface, distinct
from cohaptic_server.objects.surface.checks import edge_counts
from cohaptic_server.objects.surface.merge import merge_vertices
from cohaptic_server.objects.surface.surface_file import read_surface

SCENES = (".glb", ".gltf")


def read_surfaces(path: Path) -> tuple[PartSurface, ...]:
    """Read the surfaces of a file: one without a name, or those of several parts.

    Args:
        path: A file that `read_surface` takes.

    Raises:
        BodyError: As there.
    """
    parts = _read_nodes(path) if path.suffix.lower() in SCENES else ()
    return parts or (PartSurface("", *read_surface(path)),)


def _read_nodes(path: Path) -> tuple[PartSurface, ...]:
    import trimesh  # not with the module: a prepared object starts without it

    load: Any = trimesh.load_scene  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    trimesh_log = logging.getLogger("trimesh")
    was_disabled, trimesh_log.disabled = trimesh_log.disabled, True
    try:
        with reading_limited(path):
            return closed_nodes(load(path, process=False))
    except Exception:  # of trimesh's parsers; `read_surface` meets it again, and says it
        return ()
    finally:
        trimesh_log.disabled = was_disabled


def closed_nodes(scene: Any) -> tuple[PartSurface, ...]:
    """The nodes of a scene as parts; none unless there are several, each of them closed.

    A scene with an open node is one surface that was stored in pieces, and so is one of very many.

    Args:
        scene: A `trimesh.Scene`.
    """
    names: list[str] = []
    found: list[PartSurface] = []
    total = 0
    nodes = list(scene.graph.nodes_geometry)
    if not 2 <= len(nodes) <= MAX_PARTS:
        return ()
    for node in nodes:
        transform, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        points = np.array(getattr(mesh, "vertices", ()), dtype=np.float64).reshape(-1, 3)
        faces = np.array(getattr(mesh, "faces", ()), dtype=np.int64).reshape(-1, 3)
        matrix = np.array(transform, dtype=np.float64)
        if not len(faces) or faces.min() < 0 or faces.max() >= len(points):
            return ()
        x = points @ matrix[:3, :3].T + matrix[:3, 3]
        if not np.isfinite(x).all():
            return ()
        total += len(faces)
        if total > MAX_READ:
            return ()
        x, faces = merge_vertices(x, faces)
        if not len(faces) or (edge_counts(faces) != 2).any():
            return ()
        names.append(str(node))
        found.append(PartSurface("", x, faces))
    return tuple(
        surface._replace(name=name) for name, surface in zip(distinct(names), found, strict=True)
    )
