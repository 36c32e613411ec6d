"""Files that were made to harm whoever reads them, and where the harm would be."""

from __future__ import annotations

import base64
import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

_MODEL = (
    '<?xml version="1.0"?><model unit="millimeter" xmlns='
    '"http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
)


def three_mf(parts: dict[str, bytes]) -> bytes:
    """A zip with these files."""
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return whole.getvalue()


def zip_bomb() -> bytes:
    """A 3MF of half a megabyte whose model unpacks to 600 MiB."""
    return three_mf({"3D/3dmodel.model": _MODEL.encode() + b" " * (600 * 2**20)})


def lying_zip_bomb() -> bytes:
    """The same, with a size in the directory that says 1,000 bytes."""
    bomb = bytearray(three_mf({"3D/3dmodel.model": _MODEL.encode() + b" " * (600 * 2**20)}))
    for mark, offset in ((b"PK\x01\x02", 24), (b"PK\x03\x04", 22)):
        struct.pack_into("<I", bomb, bomb.rindex(mark) + offset, 1000)
    return bytes(bomb)


def named_a_billion_times() -> bytes:
    """A 3MF of thirty objects, each made twice of the one before."""
    mesh = (
        '<object id="1"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>'
        '<vertex x="0" y="1" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2"/>'
        "</triangles></mesh></object>"
    )
    twice = "".join(
        f'<object id="{k}"><components><component objectid="{k - 1}"/>'
        f'<component objectid="{k - 1}"/></components></object>'
        for k in range(2, 32)
    )
    built = '</resources><build><item objectid="31"/></build></model>'
    return three_mf({"3D/3dmodel.model": (_MODEL + mesh + twice + built).encode()})


def glb(header: dict[str, Any], binary: bytes, *, claimed: int | None = None) -> bytes:
    """A GLB of these two chunks; the length of the second may be a lie."""
    text = json.dumps({"asset": {"version": "2.0"}, **header}).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(binary) if claimed is None else claimed, b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _triangle(count: int = 3, length: int = 36) -> dict[str, Any]:
    """A mesh of one triangle, whose accessor says `count` of an array of `length` bytes."""
    return {
        "buffers": [{"byteLength": length}],
        "bufferViews": [{"buffer": 0, "byteLength": length}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }


_CORNERS = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def lying_glb() -> bytes:
    """A GLB that says it has two thousand million vertices in 36 bytes."""
    scene: dict[str, Any] = {"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "scene": 0}
    return glb(_triangle(2**31 - 1, 2**31 - 1) | scene, _CORNERS, claimed=2**31 - 4)


def sparse_glb() -> bytes:
    """A GLB whose accessor has no data, which stands for zeros: a thousand million of them."""
    scene: dict[str, Any] = {"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "scene": 0}
    empty = _triangle(10**9)
    del empty["accessors"][0]["bufferView"]
    return glb(empty | scene, _CORNERS)


def deep_glb(depth: int = 20_000) -> bytes:
    """A GLB whose nodes lie in one another."""
    nodes: list[dict[str, Any]] = [{"children": [k + 1]} for k in range(depth)]
    scene: dict[str, Any] = {"scenes": [{"nodes": [0]}], "nodes": [*nodes, {"mesh": 0}], "scene": 0}
    return glb(_triangle() | scene, _CORNERS)


def doubling_glb(depth: int = 40) -> bytes:
    """A GLB in which each node names the next one twice: a million million triangles."""
    nodes: list[dict[str, Any]] = [{"children": [k + 1, k + 1]} for k in range(depth)]
    scene: dict[str, Any] = {"scenes": [{"nodes": [0]}], "nodes": [*nodes, {"mesh": 0}], "scene": 0}
    return glb(_triangle() | scene, _CORNERS)


def instancing_glb() -> bytes:
    """A GLB with a mesh of 100,000 triangles that 20,000 nodes name."""
    count = 3 * 100_000
    corners = np.random.default_rng(0).random((count, 3)).astype("<f4").tobytes()
    nodes: list[dict[str, Any]] = [{"mesh": 0} for _ in range(20_000)]
    scene: dict[str, Any] = {"scenes": [{"nodes": [*range(20_000)]}], "nodes": nodes, "scene": 0}
    return glb(_triangle(count, len(corners)) | scene, corners)


def five_million_triangles() -> bytes:
    """A PLY of 20 MB: its triangles name a few vertices in bytes."""
    count = 5_000_000
    points = np.random.default_rng(0).random((250, 3)).astype("<f4")
    rows = np.random.default_rng(1).integers(0, 250, (count, 4)).astype(np.uint8)
    rows[:, 0] = 3
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 250\nproperty float x\nproperty float"
        f" y\nproperty float z\nelement face {count}\nproperty list uchar uchar vertex_indices\n"
        "end_header\n"
    )
    return head.encode() + points.tobytes() + rows.tobytes()


def lying_msh(claimed: int = 2**29) -> bytes:
    """A Gmsh file of 500 bytes whose block of nodes says that it has 13 GB."""
    head = b"$MeshFormat\n4.1 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n$Nodes\n"
    nodes = struct.pack("<4Q", 1, claimed, 1, claimed) + struct.pack("<3iQ", 3, 1, 0, claimed)
    return head + nodes + bytes(400) + b"\n$EndNodes\n"


def vtu_bomb() -> bytes:
    """A VTU of 4 MB whose compressed points unpack to 4 GiB."""
    packer = zlib.compressobj(9)
    block = b"".join(packer.compress(bytes(2**24)) for _ in range(256)) + packer.flush()
    head = struct.pack("<4Q", 1, 2**32, 0, len(block))
    points = base64.b64encode(head) + base64.b64encode(block)
    return (
        b'<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="1.0" byte_order='
        b'"LittleEndian" header_type="UInt64" compressor="vtkZLibDataCompressor">'
        b'<UnstructuredGrid><Piece NumberOfPoints="178956970" NumberOfCells="1"><Points>'
        b'<DataArray type="Float64" Name="Points" NumberOfComponents="3" format="binary">'
        + points
        + b"</DataArray></Points><Cells></Cells></Piece></UnstructuredGrid></VTKFile>"
    )


def one_polygon() -> bytes:
    """An OBJ with a single face of 300,000 corners."""
    points = "".join(f"v {k} {k * k % 97} 0\n" for k in range(300_000))
    return (points + "f " + " ".join(str(k) for k in range(1, 300_001)) + "\n").encode()


HOSTILE: dict[str, Callable[[], bytes]] = {
    "bomb.3mf": zip_bomb,
    "lying-bomb.3mf": lying_zip_bomb,
    "billion.3mf": named_a_billion_times,
    "lying.glb": lying_glb,
    "sparse.glb": sparse_glb,
    "deep.glb": deep_glb,
    "doubling.glb": doubling_glb,
    "instancing.glb": instancing_glb,
    "five-million.ply": five_million_triangles,
    "lying.msh": lying_msh,
    "bomb.vtu": vtu_bomb,
    "polygon.obj": one_polygon,
}
