"""Reads the triangles of a glTF 2.0 file, .gltf or .glb, as Khronos' specification has them.

A general reader returns a mesh even where it does not know a part of the format: sparse or
normalised accessors, instances and compressed meshes then become another object without a word.
This reader knows all that decides where a triangle lies, and refuses by name an extension that a
file requires and that is not known here. Materials, textures, cameras and animations are left out.

The shape is that of the file's default scene; else of its first scene, else of all its nodes.
"""

from __future__ import annotations

import base64
import json
import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.memory_limit import reading_limited, say_once, unreadable
from cohaptic_server.objects.object_file import MAX_READ

# Extensions that move vertices, and are read here.
_READ = {"KHR_mesh_quantization", "EXT_mesh_gpu_instancing"}
# Extensions of these families concern the look, sounds or metadata; the shape is the same without.
_OF_LOOKS = ("KHR_materials_", "EXT_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_",
             "KHR_lights_", "EXT_lights_", "KHR_xmp", "KHR_audio", "KHR_animation_",
             "ADOBE_materials_", "EXT_meshopt_fallback")  # fmt: skip
_COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
_TYPES: dict[int, type[np.generic]] = {
    5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32,
    5126: np.float32,
}  # fmt: skip
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_FLOAT = 5126
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of a primitive that make triangles
_MAX_NODES = 100_000  # nodes with all their instances
_MAX_VALUES = 10 * MAX_READ  # of all accessors; three corners of each triangle, and their vertices


class Node(NamedTuple):
    """The triangles of one primitive of a node, or of an instance of a node.

    Args:
        number: Number of the node or instance; primitives of one mesh have one number.
        name: Name of the node, else of its mesh; empty if the file names neither.
        material: Name of the primitive's material; empty if it has none.
        x: Vertices in the file's frame, shape (n, 3) [m].
        faces: Triangles, shape (m, 3).
    """

    number: int
    name: str
    material: str
    x: Floats
    faces: Ints


class _Primitive(NamedTuple):
    """Triangles of a primitive: name of its material, vertices (n, 3) and triangles (m, 3)."""

    material: str
    x: Floats
    faces: Ints


def read_nodes(path: Path) -> list[Node]:
    """Read every node of the shown scene that has triangles.

    Raises:
        BodyError: The file is no glTF 2.0, is damaged, requires an unknown extension, lacks one of
            its buffers, or has more than `MAX_READ` triangles.
    """
    try:
        with reading_limited(path):
            document, blob = _opened(path)
            _check_version(path, document)
            return list(_File(path, document, blob).nodes())
    except BodyError:
        raise
    except Exception as error:  # a damaged file fails in many ways
        raise unreadable(path, "mesh", error) from error


def _opened(path: Path) -> tuple[dict[str, Any], bytes | None]:
    """The JSON of a file, and the binary chunk of a .glb file."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        return dict(json.loads(data.decode("utf-8-sig"))), None
    version = struct.unpack_from("<I", data, 4)[0]
    if version != 2:
        raise BodyError(f"{path}: {_OLD.format(version)}")
    length = struct.unpack_from("<I", data, 8)[0]
    if length > len(data):
        raise BodyError(f"{path}: it ends after {len(data):,} of {length:,} bytes: it was cut off")
    data = data[:length]
    chunks: dict[bytes, bytes] = {}
    start = 12
    while start + 8 <= len(data):
        size, kind = struct.unpack_from("<I4s", data, start)
        chunks.setdefault(kind, data[start + 8 : start + 8 + size])
        start += 8 + size
    return dict(json.loads(chunks[b"JSON"])), chunks.get(b"BIN\0", b"")


_OLD = (
    "it is glTF {}, which is not read here. Export it as glTF 2.0, for example by importing it"
    " into Blender and exporting it from there"
)


def _check_version(path: Path, document: dict[str, Any]) -> None:
    """Refuse another version of the format, and an unknown extension that the file requires."""
    if "asset" not in document:
        raise BodyError(f"{path}: it is no glTF: it does not say of which version it is")
    asset = document["asset"]
    version = str(asset.get("minVersion", asset.get("version", "1.0")))
    if version.partition(".")[0] != "2":
        raise BodyError(f"{path}: {_OLD.format(one_line(version, 20))}")
    for name in document.get("extensionsRequired", ()):
        if name in _COMPRESSED:
            raise BodyError(f"{path}: {_compressed(name)}")
        if name not in _READ and not str(name).startswith(_OF_LOOKS):
            raise BodyError(
                f"{path}: it requires the extension {str(name)[:60]!r}, which is not read here."
                " Export it without, or as STL"
            )


def _compressed(extension: str) -> str:
    kind = _COMPRESSED[extension]
    return (
        f"its meshes are compressed by {kind} ({extension}), which is not read here. Export it"
        " without compression (in Blender: Data, Compression off), or unpack it:"
        " npx @gltf-transform/cli copy IN.glb OUT.glb"
    )


class _File:
    """The parts of one file that decide its shape.

    Args:
        path: The file; buffers that it names lie beside it.
        document: Its JSON.
        blob: Binary chunk of a .glb file; None for a .gltf file.
    """

    def __init__(self, path: Path, document: dict[str, Any], blob: bytes | None) -> None:
        self._path, self._document, self._blob = path, document, blob
        self._buffers: dict[int, bytes] = {}
        self._meshes: dict[int, list[_Primitive]] = {}
        self._triangles = self._nodes = self._decoded = 0

    def nodes(self) -> Iterator[Node]:
        """Nodes of the shown scene with triangles, in the order of the file."""
        todo = [(number, np.eye(4)) for number in reversed(self._roots())]
        seen = set[int]()
        while todo:
            number, above = todo.pop()
            if number in seen:
                raise BodyError(f"{self._path}: its node {number} has two parents, or is its own")
            seen.add(number)
            node = self._item("nodes", number)
            matrix = above @ _matrix(node)
            todo += [(child, matrix) for child in reversed(node.get("children", ()))]
            if "mesh" in node:
                yield from self._of_node(node, matrix)

    def _roots(self) -> list[int]:
        scenes = self._document.get("scenes", [])
        if "scene" in self._document:
            return list(self._item("scenes", self._document["scene"]).get("nodes", ()))
        if scenes:
            return list(scenes[0].get("nodes", ()))
        nodes = self._document.get("nodes", [])
        below = {child for node in nodes for child in node.get("children", ())}
        return [number for number in range(len(nodes)) if number not in below]

    def _of_node(self, node: dict[str, Any], matrix: Floats) -> Iterator[Node]:
        number = _whole(node["mesh"])
        mesh = self._item("meshes", number)
        if "skin" in node or any("targets" in one for one in mesh["primitives"]):
            words = "skins and morph targets are left out: the shape is the modelled one"
            say_once(self._path, words)
        if number not in self._meshes:
            self._meshes[number] = list(self._primitives(mesh, skinned="skin" in node))
        name = str(node.get("name", mesh.get("name", "")))
        for instance in self._instances(node):
            self._nodes += 1
            self._triangles += sum(len(one.faces) for one in self._meshes[number])
            if self._triangles > MAX_READ or self._nodes > _MAX_NODES:
                raise BodyError(
                    f"{self._path}: it would have more than {MAX_READ:,} triangles, or"
                    f" {_MAX_NODES:,} nodes. Simplify it first"
                )
            placed = matrix @ instance
            turned = np.linalg.det(placed[:3, :3]) < 0.0  # a mirror turns every triangle
            for material, x, faces in self._meshes[number]:
                moved = x @ placed[:3, :3].T + placed[:3, 3]
                faces = faces[:, ::-1] if turned else faces
                yield Node(self._nodes, name, material, moved, faces)

    def _primitives(self, mesh: dict[str, Any], *, skinned: bool) -> Iterator[_Primitive]:
        """Primitives of a mesh with triangles, in the mesh's own frame."""
        for primitive in mesh["primitives"]:
            mode = primitive.get("mode", _TRIANGLES)
            if mode not in (_TRIANGLES, _STRIP, _FAN):
                continue  # points and lines
            accessor = primitive["attributes"]["POSITION"]
            described = self._item("accessors", accessor)
            for extension in primitive.get("extensions", {}):
                if extension in _COMPRESSED and "bufferView" not in described:
                    raise BodyError(f"{self._path}: {_compressed(extension)}")
            if skinned and described["componentType"] != _FLOAT:
                raise BodyError(
                    f"{self._path}: its skinned mesh has quantised positions, whose size is in its"
                    " skin. Export it without quantisation, or without the skin"
                )
            x = self._values(accessor, "VEC3")
            order = np.arange(len(x))
            if "indices" in primitive:
                order = self._values(primitive["indices"], "SCALAR").ravel().astype(np.int64)
            if len(order) and not 0 <= order.min() <= order.max() < len(x):
                raise BodyError(f"{self._path}: a triangle names vertex {order.max()} of {len(x)}")
            # Primitives may share one buffer of vertices, of which each uses a few.
            used, faces = np.unique(_triangles(order, mode), return_inverse=True)
            if len(used):
                yield _Primitive(self._material(primitive), x[used], faces.reshape(-1, 3))

    def _material(self, primitive: dict[str, Any]) -> str:
        if "material" not in primitive:
            return ""
        return str(self._item("materials", primitive["material"]).get("name", ""))

    def _instances(self, node: dict[str, Any]) -> list[Floats]:
        """Matrices of the node's instances; one identity if it has no instances of its own."""
        instancing = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
        if instancing is None:
            return [np.eye(4)]
        types = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
        found = {
            key.lower(): self._values(accessor, types[key])
            for key, accessor in instancing.get("attributes", {}).items()
            if key in types
        }
        counts = {len(values) for values in found.values()}
        if len(counts) != 1 or not 0 < max(counts) <= _MAX_NODES:
            raise BodyError(
                f"{self._path}: the instances of a node need from 1 to {_MAX_NODES:,} places, and"
                f" as many of each kind; found: {sorted(counts)}"
            )
        rows = range(max(counts))
        return [_matrix({key: values[i] for key, values in found.items()}) for i in rows]

    def _values(self, number: int, kind: str) -> Floats:
        """Values of an accessor, sparse and normalised ones included, shape (count, width)."""
        accessor = self._item("accessors", number)
        if accessor["type"] != kind:
            found = one_line(str(accessor["type"]), 20)
            raise BodyError(f"{self._path}: accessor {number} has {found}, not {kind}")
        count, dtype = _whole(accessor["count"]), np.dtype(_TYPES[accessor["componentType"]])
        self._decoded += count
        if count < 1 or self._decoded > _MAX_VALUES:
            raise BodyError(
                f"{self._path}: accessor {number} has {count:,} values, and needs one or more; the"
                f" limit is {_MAX_VALUES:,} for all accessors together. Simplify it first"
            )
        width = _WIDTHS[kind]
        if "bufferView" in accessor:
            start = accessor.get("byteOffset", 0)
            values = self._view(accessor["bufferView"], start, count, width, dtype).copy()
        else:
            values = np.zeros((count, width), dtype=dtype)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            where, what, some = sparse["indices"], sparse["values"], _whole(sparse["count"])
            kind_of_index = np.dtype(_TYPES[where["componentType"]])
            rows = self._view(
                where["bufferView"], where.get("byteOffset", 0), some, 1, kind_of_index
            )
            given = self._view(what["bufferView"], what.get("byteOffset", 0), some, width, dtype)
            values[rows[:, 0].astype(np.int64)] = given
        decoded: Floats = values.astype(np.float64)
        if accessor.get("normalized") and dtype.kind in "iu":
            largest: float = np.iinfo(dtype.name).max
            decoded = np.maximum(decoded / largest, -1.0)
        return decoded

    def _view(self, number: int, start: int, count: int, width: int, dtype: Any) -> Any:
        """Values at a place of a buffer view, shape (count, width); they share its memory."""
        view = self._item("bufferViews", number)
        for extension in view.get("extensions", {}):
            fallback = self._item("buffers", view["buffer"]).get("uri")
            if extension in _COMPRESSED and fallback is None:
                raise BodyError(f"{self._path}: {_compressed(extension)}")
        data = self._buffer(_whole(view["buffer"]))
        first, length = _whole(view.get("byteOffset", 0)), _whole(view["byteLength"])
        own = width * dtype.itemsize
        stride = _whole(view.get("byteStride", own))
        end = _whole(start) + stride * (count - 1) + own if count else 0
        if end > length or first + length > len(data) or stride < own:
            raise BodyError(
                f"{self._path}: buffer view {number} has {length:,} bytes of {len(data):,};"
                f" {end:,} are named. It was cut off, or written by a faulty program"
            )
        return np.ndarray(
            (count, width), dtype.newbyteorder("<"), data, first + start, (stride, dtype.itemsize)
        )

    def _buffer(self, number: int) -> bytes:
        if number not in self._buffers:
            self._buffers[number] = self._loaded(number)
        return self._buffers[number]

    def _loaded(self, number: int) -> bytes:
        uri = self._item("buffers", number).get("uri")
        if uri is None:
            if self._blob is None or number != 0:
                raise BodyError(f"{self._path}: it has no data for its buffer {number}")
            return self._blob
        if str(uri).startswith("data:"):
            return base64.b64decode(str(uri).partition(",")[2])
        folder = self._path.parent.resolve()
        file = (folder / unquote(str(uri))).resolve()
        if not file.is_relative_to(folder) or not file.is_file():
            raise BodyError(
                f"{self._path}: its data is in {str(uri)[:80]!r}, which is not beside it. Keep both"
                " in one folder, or export a .glb, which holds everything"
            )
        return file.read_bytes()

    def _item(self, key: str, number: Any) -> dict[str, Any]:
        items = self._document.get(key, [])
        if not 0 <= _whole(number) < len(items):
            raise BodyError(f"{self._path}: it names number {number} of {len(items)} {key}")
        return dict(items[number])


def _whole(value: Any) -> int:
    """A count or an index of the file; anything but a whole number from 0 to 2^53 is an error."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 2**53:
        raise ValueError(f"{value!r:.40} in place of a whole number")
    return value


def _triangles(order: Ints, mode: int) -> Ints:
    """Triangles of a primitive, shape (m, 3); every second one of a strip is turned round."""
    if mode == _TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if len(order) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if mode == _FAN:
        hub = np.full(len(order) - 2, order[0])
        return np.stack([order[1:-1], order[2:], hub], axis=1)
    faces = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    faces[1::2, 1:] = faces[1::2, :0:-1]
    return faces


def _matrix(node: dict[str, Any]) -> Floats:
    """Matrix of a node: its own, or that of its translation, rotation (x, y, z, w) and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.asarray(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    s = 2.0 / max(math.fsum((x * x, y * y, z * z, w * w)), 1e-300)  # also of any length but 1
    turn = np.array(
        [
            [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.asarray(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    matrix[:3, 3] = np.asarray(node.get("translation", (0.0, 0.0, 0.0)), dtype=np.float64)
    return matrix
