"""glTF as specified: every way to write one cube gives that cube, and what is unknown is named."""

from __future__ import annotations

import base64
import json
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.surface.gltf import Node, read_nodes
from cohaptic_server.objects.surface.surface_file import read_surface
from tests.server.objects.surface.test_as_they_come import cube, is_the_cube

FLOAT, SHORT, USHORT, UINT = 5126, 5122, 5123, 5125


class Scene:
    """A glTF document that grows by accessors; a test changes what it is about."""

    def __init__(self) -> None:
        self.blob = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, values: Any) -> int:
        self.blob += b"\0" * (-len(self.blob) % 4)
        raw = np.ascontiguousarray(values).tobytes()
        views = self.document["bufferViews"]
        views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(raw)})
        self.blob += raw
        return len(views) - 1

    def accessor(self, values: Any, component: int, kind: str, **more: Any) -> int:
        accessors = self.document["accessors"]
        entry = {"bufferView": self.view(values), "componentType": component, "type": kind}
        accessors.append(entry | {"count": len(values)} | more)
        return len(accessors) - 1

    def glb(self, path: Path, version: int = 2) -> Path:
        self.document["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text
        body += struct.pack("<I4s", len(self.blob), b"BIN\0") + self.blob
        path.write_bytes(struct.pack("<4sII", b"glTF", version, 12 + len(body)) + body)
        return path


def scene() -> Scene:
    """A cube of 100 mm, with nothing special."""
    x, faces = cube()
    made = Scene()
    made.accessor(x.astype("<f4"), FLOAT, "VEC3")
    made.accessor(faces.ravel().astype("<u4"), UINT, "SCALAR")
    return made


def one(made: Scene, tmp_path: Path) -> Node:
    (node,) = read_nodes(made.glb(tmp_path / "a.glb"))
    return node


def test_a_cube_is_a_cube(tmp_path: Path) -> None:
    assert is_the_cube(read_surface(scene().glb(tmp_path / "a.glb")))


def test_transforms_are_passed_down_and_a_mirror_keeps_the_outside_outside(tmp_path: Path) -> None:
    made = scene()
    half = math.sqrt(0.5)
    made.document["nodes"] = [
        {"children": [1], "translation": [1.0, 0.0, 0.0], "rotation": [0.0, 0.0, half, half]},
        {"mesh": 0, "scale": [-2.0, 1.0, 1.0], "name": "mirrored"},
    ]
    node = one(made, tmp_path)
    assert node.name == "mirrored"
    # The cube lies along -x, is turned by a quarter about z onto -y, and moved by 1 m.
    assert node.x.min(axis=0) == pytest.approx([0.9, -0.2, 0.0], abs=1e-6)
    assert node.x.max(axis=0) == pytest.approx([1.0, 0.0, 0.1], abs=1e-6)
    plain = one(scene(), tmp_path)
    assert np.sign(volume(node)) == np.sign(volume(plain))
    matrix = np.array([[0, -1, 0, 1], [-2, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)
    made.document["nodes"] = [{"mesh": 0, "matrix": matrix.T.ravel().tolist()}]
    assert one(made, tmp_path).x == pytest.approx(node.x, abs=1e-6)


def volume(node: Node) -> float:
    a, b, c = np.moveaxis(node.x[node.faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def test_data_beside_a_file_or_in_it_is_found(tmp_path: Path) -> None:
    made = scene()
    encoded = base64.b64encode(made.blob).decode()
    path = tmp_path / "a.gltf"
    (tmp_path / "its data.bin").write_bytes(made.blob)
    for uri in (f"data:application/octet-stream;base64,{encoded}", "its%20data.bin"):
        made.document["buffers"] = [{"byteLength": len(made.blob), "uri": uri}]
        path.write_text(json.dumps(made.document))
        assert is_the_cube(read_surface(path))


CHANGES: list[tuple[dict[str, Any], str]] = [
    ({"asset": {"version": "1.0"}}, "glTF 1.0, which is not read"),
    ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed by Draco"),
    ({"extensionsRequired": ["EXT_meshopt_compression"]}, "compressed by meshopt"),
    ({"extensionsRequired": ["ACME_bent_space"]}, "requires the extension 'ACME_bent_space'"),
    ({"nodes": [{"mesh": 0, "children": [0]}]}, "two parents, or is its own"),
    ({"nodes": [{"children": [1, 1]}, {"mesh": 0}]}, "two parents"),
    ({"nodes": [{"mesh": 7}]}, "number 7 of 1 meshes"),
    ({"nodes": [{"mesh": -1}]}, "no mesh that can be read"),
    ({"scenes": [{"nodes": [True]}]}, "no mesh that can be read"),
    ({"scenes": [{}]}, "there is no triangle in it"),
]


@pytest.mark.parametrize(("change", "words"), CHANGES)
def test_what_cannot_be_read_is_named(change: dict[str, Any], words: str, tmp_path: Path) -> None:
    made = scene()
    made.document |= change
    with pytest.raises(BodyError, match=words):
        read_surface(made.glb(tmp_path / "a.glb"))


@pytest.mark.parametrize(
    ("accessor", "change", "words"),
    [
        (0, {"count": 9}, "96 bytes .*; 108 are named"),
        (0, {"count": 2**40}, "values, and needs one"),
        (0, {"byteOffset": 2**40}, "are named"),
        (0, {"type": "VEC2"}, "has VEC2, not VEC3"),
        (0, {"type": "SC" * 900}, r"has (SC){10}\.\.\., not VEC3"),
        (0, {"count": 10**4000}, "no mesh that can be read"),
        (0, {"componentType": 5124}, "no mesh that can be read"),
        (1, {"count": 0}, "values, and needs one"),
        (1, {"bufferView": 0, "count": 24}, "a triangle names vertex"),
    ],
)
def test_a_lying_accessor_is_refused(
    accessor: int, change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    made = scene()
    made.document["accessors"][accessor] |= change
    with pytest.raises(BodyError, match=words):
        read_surface(made.glb(tmp_path / "a.glb"))


def test_a_file_that_was_cut_off_says_so(tmp_path: Path) -> None:
    path = scene().glb(tmp_path / "a.glb")
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(BodyError, match="it was cut off"):
        read_surface(path)


def test_the_first_version_of_the_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BodyError, match=r"it is glTF 1, .* Export it as glTF 2\.0"):
        read_surface(scene().glb(tmp_path / "a.glb", version=1))


@pytest.mark.parametrize("uri", ["../secret.bin", "/etc/hostname", "gone.bin"])
def test_no_file_is_read_but_those_beside_it(uri: str, tmp_path: Path) -> None:
    made = scene()
    (tmp_path / "secret.bin").write_bytes(made.blob)
    (tmp_path / "own").mkdir()
    path = tmp_path / "own/a.gltf"
    made.document["buffers"] = [{"byteLength": len(made.blob), "uri": uri}]
    path.write_text(json.dumps(made.document))
    with pytest.raises(BodyError, match=r"not beside it\. Keep both in one folder"):
        read_surface(path)


def test_vertices_that_many_nodes_would_read_again_are_read_once(tmp_path: Path) -> None:
    """Of a file of some kilobytes: a long accessor of zeros, two indices, and many nodes."""
    made = scene()
    made.document["accessors"][0] = {"componentType": FLOAT, "type": "VEC3", "count": 4_000_000}
    made.document["accessors"][1]["count"] = 2
    made.document["nodes"] = [{"mesh": 0} for _ in range(2000)]
    made.document["scenes"] = [{"nodes": list(range(2000))}]
    with pytest.raises(BodyError, match="there is no triangle in it"):
        read_surface(made.glb(tmp_path / "a.glb"))
    made.document["meshes"] = [dict(made.document["meshes"][0]) for _ in range(2000)]
    made.document["nodes"] = [{"mesh": k} for k in range(2000)]
    with pytest.raises(BodyError, match=r"the limit is .* for all accessors together"):
        read_surface(made.glb(tmp_path / "a.glb"))


def test_a_skinned_mesh_whose_size_is_in_its_skin_is_refused(tmp_path: Path) -> None:
    made = scene()
    made.document["nodes"][0]["skin"] = 0
    assert is_the_cube(read_surface(made.glb(tmp_path / "a.glb")))
    made.document["accessors"][0]["componentType"] = SHORT
    with pytest.raises(BodyError, match="skinned mesh has quantised positions"):
        read_surface(made.glb(tmp_path / "a.glb"))
