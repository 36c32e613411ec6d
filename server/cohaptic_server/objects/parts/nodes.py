"""Reads the closed nodes of a GLB or glTF scene as parts with materials of their own."""

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
    """Read the surfaces of a file: a single one without a name, or those of several parts.

    Args:
        path: A file of one of `SURFACES`.

    Raises:
        BodyError: `read_surface` refuses the file.
    """
    parts = _read_nodes(path) if path.suffix.lower() in SCENES else ()
    return parts or (PartSurface("", *read_surface(path)),)


def _read_nodes(path: Path) -> tuple[PartSurface, ...]:
    import trimesh  # imported here, since a prepared object starts without trimesh

    load: Any = trimesh.load_scene  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    trimesh_log = logging.getLogger("trimesh")
    was_disabled, trimesh_log.disabled = trimesh_log.disabled, True
    try:
        with reading_limited(path):
            return closed_nodes(load(path, process=False))
    except Exception:  # from trimesh's parsers; `read_surface` fails in the same way and reports it
        return ()
    finally:
        trimesh_log.disabled = was_disabled


def closed_nodes(scene: Any) -> tuple[PartSurface, ...]:
    """Nodes of a scene as parts; empty unless there are several nodes, all of them closed.

    A scene with an open node, or with very many nodes, is taken for one surface that was stored in
    pieces.

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
