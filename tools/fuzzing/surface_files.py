"""Valid surfaces in each format, written by another library than the one that reads it.

trimesh reads STL, OBJ, PLY and OFF, so meshio writes them; glTF and 3MF are read by readers of our
own, so trimesh writes them. What neither writes is written here from the specification: quads and
negative indices of OBJ, big-endian PLY, and instances, sparse and quantised values of glTF.
"""

from __future__ import annotations

import contextlib
import io
import re
import struct
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import trimesh

from fuzzing.drafts import PLACE, Draft, glb, gltf, text_of, zipped
from fuzzing.shapes import SIZE, Shape, ball, tetrahedron, torus

SHAPES = (tetrahedron(), ball(1), ball(2), torus())


def by_meshio(suffix: str, mesh: Any, form: str, **options: Any) -> bytes:
    """The bytes of a file that meshio writes.

    Args:
        mesh: A `meshio.Mesh`.
        form: Name of the format, as meshio knows it; also `gmsh40`.
        options: Options of the writer.
    """
    library: Any = meshio
    write = library.gmsh.write if form == "gmsh40" else library.write
    options |= {"fmt_version": "4.0"} if form == "gmsh40" else {"file_format": form}
    silent = io.StringIO()
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.redirect_stdout(silent),
        contextlib.redirect_stderr(silent),
    ):
        path = Path(folder) / f"a{suffix}"
        write(path, mesh, **options)
        return re.sub(rb"(Created by meshio v[\d.]+), .*", rb"\1", path.read_bytes())


def _by_trimesh(mesh: Any, form: str) -> bytes:
    return bytes(mesh.export(file_type=form))


def _of(shape: Shape) -> Any:
    return meshio.Mesh(shape.x, [("triangle", shape.faces.astype(np.int32))])


def stl() -> Iterator[Draft]:
    """Text and binary; also UTF-16 with old line ends, and bytes behind the end."""
    for shape in SHAPES:
        for binary in (False, True):
            data = by_meshio(".stl", _of(shape), "stl", binary=binary)
            yield Draft(f"{shape.name} {'binary' if binary else 'text'}", (data,), shape.volume)
    shape = ball(1)
    text = by_meshio(".stl", _of(shape), "stl").decode().replace("\n", "\r").upper()
    yield Draft("utf-16", (text.encode("utf-16"),), shape.volume)
    data = by_meshio(".stl", _of(shape), "stl", binary=True)
    yield Draft("behind the end", (data, b"x" * 60), shape.volume)


def obj() -> Iterator[Draft]:
    """Triangles; also quads, texture corners, groups and indices from the end."""
    for shape in SHAPES:
        data = by_meshio(".obj", _of(shape), "obj")
        yield Draft(shape.name, (data,), shape.volume)
    shape = torus()
    lines = [f"v {x} {y} {z}" for x, y, z in shape.x.tolist()]
    count, half = len(shape.x), len(shape.faces) // 2
    lines += ["vt 0 0", "vn 0 0 1", "g ring", "usemtl rubber", "s off"]
    for (a, b, d), (_, _, c) in zip(shape.faces[:half], shape.faces[half:], strict=True):
        lines.append("f " + " ".join(f"{k - count}/1/1" for k in (a, b, d, c)))
    yield Draft("quads", ("\n".join(lines).encode(),), shape.volume)
    commas = "\r\n".join(lines).replace(".", ",")
    yield Draft("commas", (commas.encode(),), shape.volume)


def ply() -> Iterator[Draft]:
    """Text and binary in both orders of bytes."""
    for shape in SHAPES:
        for binary in (False, True):
            data = by_meshio(".ply", _of(shape), "ply", binary=binary)
            yield Draft(f"{shape.name} {'binary' if binary else 'text'}", (data,), shape.volume)
    shape = ball(1)
    head = (
        f"ply\nformat binary_big_endian 1.0\nelement vertex {len(shape.x)}\nproperty float x\n"
        f"property float y\nproperty float z\nproperty uchar red\nelement face {len(shape.faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()
    body = b"".join(struct.pack(">3fB", *row, 7) for row in shape.x.tolist())
    body += b"".join(struct.pack(">B3i", 3, *row) for row in shape.faces.tolist())
    yield Draft("big-endian", (head, body), shape.volume)


def off() -> Iterator[Draft]:
    """Text, also with colours and comments."""
    for shape in SHAPES:
        data = by_meshio(".off", _of(shape), "off")
        yield Draft(shape.name, (data,), shape.volume)
    shape = ball(1)
    lines = ["OFF", "# a ball", f"{len(shape.x)} {len(shape.faces)} 0"]
    lines += [f"{x} {y} {z}" for x, y, z in shape.x.tolist()]
    lines += [f"3 {a} {b} {c} 255 0 0" for a, b, c in shape.faces.tolist()]
    yield Draft("coloured", ("\n".join(lines).encode(),), shape.volume)


_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"


def three_mf() -> Iterator[Draft]:
    """As trimesh writes it, and with components that are moved."""
    for shape in SHAPES:
        in_mm = trimesh.Trimesh(1e3 * shape.x, shape.faces, process=False)
        with zipfile.ZipFile(io.BytesIO(_by_trimesh(in_mm, "3mf"))) as archive:
            names = archive.namelist()
            # Its identifiers are random.
            parts = [re.sub(rb'UUID="[^"]*"', b'UUID="0"', archive.read(name)) for name in names]
        yield Draft(shape.name, tuple(parts), shape.volume, zipped(names))
    shape = ball(1)
    in_text = (f'x="{x}" y="{y}" z="{z}"' for x, y, z in (1e3 * shape.x).tolist())
    points = "".join(f"<vertex {place}/>" for place in in_text)
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in shape.faces.tolist())
    model = (
        f'<model unit="millimeter" xmlns="{_CORE}"><resources><object id="1" type="model"><mesh>'
        f'<vertices>{points}</vertices><triangles>{faces}</triangles></mesh></object><object id="2"'
        '><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 5 6 7"/></components>'
        '</object></resources><build><item objectid="2" transform="0 1 0 -1 0 0 0 0 1 1 2 3"/>'
        "</build></model>"
    )
    root, part = "3D/3dmodel.model", "3D/Objects/one.model"
    yield Draft("components", (model.encode(),), shape.volume, zipped((root,)))
    outer = (
        f'<model xmlns="{_CORE}" xmlns:p="{_PRODUCTION}" requiredextensions="p"><resources><object'
        f' id="3"><components><component p:path="/{part}" objectid="2"/></components></object>'
        f'<object id="4" type="support"><mesh><vertices>{points}</vertices><triangles>{faces}'
        '</triangles></mesh></object></resources><build><item objectid="3"/><item objectid="4"/>'
        "</build></model>"
    )
    pieces = outer.encode(), model.encode()
    yield Draft("parts", pieces, shape.volume, zipped((root, part)))


class Scene:
    """A glTF document that grows by accessors, and its binary data."""

    def __init__(self) -> None:
        self.blob = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "one"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, values: Any) -> int:
        """Add an array, and return the number of its view."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        raw = np.ascontiguousarray(values).tobytes()
        views = self.document["bufferViews"]
        views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(raw)})
        self.blob += raw
        return len(views) - 1

    def accessor(self, values: Any, component: int, kind: str, **more: Any) -> int:
        """Add an array, and return the number of its accessor."""
        accessors = self.document["accessors"]
        entry = {"bufferView": self.view(values), "componentType": component, "type": kind}
        accessors.append(entry | {"count": len(values)} | more)
        return len(accessors) - 1

    def draft(self, name: str, volume: float, *, embedded: bool, within: float = 1e-5) -> Draft:
        """The file; with its binary data in the JSON if it is embedded."""
        size: dict[str, Any] = {"byteLength": len(self.blob)}
        document = self.document | {"buffers": [size | ({"uri": PLACE} if embedded else {})]}
        pack = gltf if embedded else glb
        return Draft(name, (text_of(document), self.blob), volume, pack, within)


_FLOAT, _SHORT, _USHORT, _UINT = 5126, 5122, 5123, 5125


def _plain(shape: Shape) -> Scene:
    scene = Scene()
    scene.accessor(shape.x.astype("<f4"), _FLOAT, "VEC3")
    scene.accessor(shape.faces.ravel().astype("<u2"), _USHORT, "SCALAR")
    return scene


# Above 60 lines: each paragraph is one way to write a scene, and they share nothing but `_plain`.
def scenes(*, embedded: bool) -> Iterator[Draft]:
    """Every way to say where a triangle lies: transforms, parts, and each kind of accessor."""
    shape = ball(1)
    scene = _plain(shape)
    turn = [0.0, 0.6, 0.0, 0.8]
    scene.document["nodes"] = [
        {"children": [1], "rotation": turn, "translation": [0.1, 0.2, 0.3]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
    ]
    yield scene.draft("transformed", shape.volume, embedded=embedded)

    scene = _plain(shape)
    scene.document["nodes"] = [
        {"mesh": 0, "name": "outer"},
        {"mesh": 0, "name": "inner", "scale": [0.5, 0.5, 0.5]},
    ]
    scene.document["scenes"] = [{"nodes": [0, 1]}]
    yield scene.draft("nested", shape.volume * 9 / 8, embedded=embedded)

    scene = _plain(shape)
    places = np.array([[0.0, 0.0, 0.0], [SIZE, SIZE, 0.0]], dtype="<f4")
    attributes = {"TRANSLATION": scene.accessor(places, _FLOAT, "VEC3")}
    instancing = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    scene.document["nodes"][0]["extensions"] = instancing
    scene.document["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    yield scene.draft("instances", 2.0 * shape.volume, embedded=embedded)

    scene = _plain(shape)
    rows = np.array([1, 5, 6], dtype="<u2")
    wrong = shape.x.copy()
    wrong[rows] += 1.0
    position = scene.document["accessors"][0]
    position["bufferView"] = scene.view(wrong.astype("<f4"))
    position["sparse"] = {
        "count": len(rows),
        "indices": {"bufferView": scene.view(rows), "componentType": _USHORT},
        "values": {"bufferView": scene.view(shape.x[rows].astype("<f4"))},
    }
    yield scene.draft("sparse", shape.volume, embedded=embedded)

    scene = _plain(shape)
    whole = np.round(shape.x / SIZE * 32767).astype("<i2")
    padded = scene.accessor(np.pad(whole, ((0, 0), (0, 1))), _SHORT, "VEC3", normalized=True)
    scene.document["bufferViews"][-1]["byteStride"] = 8
    scene.document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = padded
    scene.document["nodes"][0]["scale"] = [SIZE, SIZE, SIZE]
    scene.document["extensionsRequired"] = ["KHR_mesh_quantization"]
    yield scene.draft("quantised", shape.volume, embedded=embedded, within=1e-3)

    scene = _plain(shape)
    (primitive,) = scene.document["meshes"][0]["primitives"]
    inner = scene.accessor((0.5 * shape.x).astype("<f4"), _FLOAT, "VEC3")
    scene.document["materials"] = [{"name": "skin"}, {"name": "bone"}]
    scene.document["meshes"][0]["primitives"] = [
        primitive | {"material": 0, "targets": [{"POSITION": 0}]},
        {"attributes": {"POSITION": inner}, "indices": 1, "material": 1},
        {"attributes": {"POSITION": inner}, "mode": 0},
    ]
    scene.document["nodes"][0]["skin"] = 0
    yield scene.draft("materials", shape.volume * 9 / 8, embedded=embedded)

    scene = _plain(shape)
    triangles = scene.accessor(shape.x[shape.faces].reshape(-1, 3).astype("<f4"), _FLOAT, "VEC3")
    scene.document["meshes"][0]["primitives"] = [{"attributes": {"POSITION": triangles}}]
    del scene.document["scene"], scene.document["scenes"]
    yield scene.draft("without indices", shape.volume, embedded=embedded)

    flat = tetrahedron()
    scene = _plain(flat)
    strip = np.array([2, 0, 1, 3, 2, 0], dtype="<u4")
    scene.document["accessors"][1] |= {
        "bufferView": scene.view(strip), "componentType": _UINT, "count": len(strip),
    }  # fmt: skip
    scene.document["meshes"][0]["primitives"][0]["mode"] = 5
    yield scene.draft("strip", flat.volume, embedded=embedded)


def glb_files() -> Iterator[Draft]:
    """As trimesh writes it, and each of `scenes`."""
    for shape in SHAPES:
        mesh = trimesh.Trimesh(shape.x, shape.faces, process=False)
        data = _by_trimesh(mesh, "glb")
        length = struct.unpack_from("<I", data, 12)[0]
        pieces = data[20 : 20 + length], data[28 + length :]
        yield Draft(shape.name, pieces, shape.volume, glb)
    yield from scenes(embedded=False)


def gltf_files() -> Iterator[Draft]:
    """Each of `scenes`, with its data in the file."""
    for shape in SHAPES:
        yield _plain(shape).draft(shape.name, shape.volume, embedded=True)
    yield from scenes(embedded=True)
