"""A sound file of each kind that an upload takes."""

from __future__ import annotations

import base64
import gzip
import io
import json
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import trimesh

from cohaptic_server.testing.blocks import block
from shapes.phantom import nifti


def surface(kind: str) -> bytes:
    """A box of 10 cm, as a file of this kind."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))  # pyright: ignore[reportUnknownMemberType]
    whole = io.BytesIO()
    box.export(whole, file_type=kind[1:])  # pyright: ignore[reportUnknownMemberType]
    return whole.getvalue()


def whole_gltf() -> bytes:
    """The same as a glTF of text that needs no other file."""
    box: Any = trimesh.creation.box((0.1, 0.1, 0.1))  # pyright: ignore[reportUnknownMemberType]
    files: dict[str, bytes] = box.export(file_type="gltf")
    tree = json.loads(files["model.gltf"])
    for buffer in tree["buffers"]:
        packed = base64.b64encode(files[buffer["uri"]]).decode()
        buffer["uri"] = f"data:application/octet-stream;base64,{packed}"
    return json.dumps(tree).encode()


def volume(kind: str, form: str | None = None) -> bytes:
    """A block of tetrahedra."""
    tets = block((0.1, 0.1, 0.1), (2, 2, 2))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"block{kind}"
        whole: Any = meshio.Mesh(tets.vertices, [("tetra", tets.tets)])
        whole.write(path, file_format=form)
        return path.read_bytes()


def voxels() -> Any:
    """A cube of a label, shape (12, 12, 12)."""
    values = np.zeros((12, 12, 12), dtype=np.uint8)
    values[2:10, 2:10, 2:10] = 1
    return values


def nrrd() -> bytes:
    """It as a compressed NRRD."""
    head = (
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 12 12 12\nencoding: gzip\n"
        "spacings: 2 2 2\nendian: little\n\n"
    )
    return head.encode() + gzip.compress(voxels().tobytes(), mtime=0)


SOUND: dict[str, Callable[[], bytes]] = {
    **{kind: partial(surface, kind) for kind in (".stl", ".obj", ".ply", ".glb", ".3mf", ".off")},
    ".gltf": whole_gltf,
    ".msh": partial(volume, ".msh", "gmsh"),
    ".vtk": partial(volume, ".vtk"),
    ".vtu": partial(volume, ".vtu"),
    ".nii": lambda: nifti(voxels()),
    ".nii.gz": lambda: gzip.compress(nifti(voxels()), mtime=0),
    ".nrrd": nrrd,
}
