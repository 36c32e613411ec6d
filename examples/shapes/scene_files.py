"""Bytes of files that hold more than one surface: GLB and 3MF scenes, VTU and MSH volumes."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Ints
from shapes.grids import Mesh

_FLOAT, _UINT = 5126, 5125  # component types of glTF
_EPOCH = (1980, 1, 1, 0, 0, 0)  # of every file in a zip, so that the bytes do not change


def parts_glb(parts: Mapping[str, Mesh]) -> bytes:
    """The bytes of a GLB file with a node for each part.

    Args:
        parts: Surfaces by the names of their nodes.
    """
    nodes = [{"name": name, "mesh": k} for k, name in enumerate(parts)]
    return glb(list(parts.values()), [*nodes, {"children": list(range(len(nodes)))}], len(nodes))


def glb(meshes: Sequence[Mesh], nodes: Sequence[Mapping[str, Any]], root: int = 0) -> bytes:
    """The bytes of a GLB file.

    Args:
        meshes: The surfaces, by the numbers that nodes have for them.
        nodes: Nodes of the scene as glTF has them.
        root: Root of the nodes.
    """
    data, views, accessors = b"", list[Any](), list[Any]()
    for points, triangles in meshes:
        x, faces = points.astype("<f4"), triangles.astype("<u4")
        for array in (x, faces):
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
            data += array.tobytes()
        accessors += [
            {
                "bufferView": len(views) - 2,
                "componentType": _FLOAT,
                "count": len(x),
                "type": "VEC3",
                "min": x.min(axis=0).tolist(),
                "max": x.max(axis=0).tolist(),
            },
            {
                "bufferView": len(views) - 1,
                "componentType": _UINT,
                "count": faces.size,
                "type": "SCALAR",
            },
        ]
    whole = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [root]}],
        "nodes": list(nodes),
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 2 * k}, "indices": 2 * k + 1}]}
            for k in range(len(meshes))
        ],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    parts = [(text, b"JSON"), (data, b"BIN\0")]
    body = b"".join(len(part).to_bytes(4, "little") + kind + part for part, kind in parts)
    return b"glTF" + np.array([2, 12 + len(body)], dtype="<u4").tobytes() + body


def three_mf(mesh: Mesh) -> bytes:
    """The bytes of a 3MF file in millimetres whose object is a moved component of another.

    Args:
        mesh: The surface [m].
    """
    x, faces = 1000.0 * mesh[0], mesh[1]
    vertices = "".join(f'<vertex x="{a:.4f}" y="{b:.4f}" z="{c:.4f}"/>' for a, b, c in x.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces.tolist())
    model = (
        '<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter"'
        ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1" type="model"><mesh><vertices>{vertices}</vertices>'
        f"<triangles>{triangles}</triangles></mesh></object>"
        '<object id="2" type="model"><components><component objectid="1"'
        ' transform="1 0 0 0 1 0 0 0 1 20 0 0"/></components></object>'
        '</resources><build><item objectid="2"/></build></model>'
    )
    types = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels"'
        ' ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model"'
        ' ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
    )
    relations = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        '<Relationship Target="/3D/3dmodel.model" Id="rel0"'
        ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
    )
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        files = {"[Content_Types].xml": types, "_rels/.rels": relations, "3D/3dmodel.model": model}
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), text, zipfile.ZIP_DEFLATED)
    return out.getvalue()


def vtu(mesh: TetMesh) -> bytes:
    """The bytes of a VTU file of tetrahedra, in text."""
    n, m = len(mesh.vertices), len(mesh.tets)

    def array(name: str, kind: str, values: str, more: str = "") -> str:
        return f'<DataArray type="{kind}" Name="{name}"{more} format="ascii">{values}</DataArray>'

    points = " ".join(f"{v:.7f}" for v in mesh.vertices.ravel().tolist())
    cells = " ".join(map(str, mesh.tets.ravel().tolist()))
    offsets = " ".join(str(4 * (k + 1)) for k in range(m))
    more = ' NumberOfComponents="3"'
    return (
        '<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="0.1"'
        ' byte_order="LittleEndian"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{n}" NumberOfCells="{m}">'
        f"<Points>{array('Points', 'Float64', points, more)}</Points><Cells>"
        f"{array('connectivity', 'Int64', cells)}{array('offsets', 'Int64', offsets)}"
        f"{array('types', 'UInt8', ' '.join(['10'] * m))}"
        "</Cells></Piece></UnstructuredGrid></VTKFile>\n"
    ).encode()


def msh(mesh: TetMesh, groups: Sequence[str] = (), of: Ints | None = None) -> bytes:
    """The bytes of a file of Gmsh 2.2 in text: tetrahedra, and a point that is none.

    Args:
        mesh: The tetrahedra.
        groups: Names of physical groups.
        of: Group of each tetrahedron, shape (m,); without it they are in none.
    """
    tags = np.zeros(len(mesh.tets), dtype=np.int64) if of is None else 1 + of
    points = [f"{k} {a:.7f} {b:.7f} {c:.7f}" for k, (a, b, c) in enumerate(mesh.vertices, start=1)]
    cells = [
        f"{k} 4 2 {tag} 1 " + " ".join(map(str, row))
        for k, (tag, row) in enumerate(zip(tags.tolist(), mesh.tets + 1, strict=True), start=2)
    ]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat"]
    if groups:
        names = [f'3 {k} "{name}"' for k, name in enumerate(groups, start=1)]
        lines += ["$PhysicalNames", str(len(names)), *names, "$EndPhysicalNames"]
    lines += ["$Nodes", str(len(points)), *points]
    lines += ["$EndNodes", "$Elements", str(len(cells) + 1), "1 15 2 0 1 1", *cells]
    return ("\n".join([*lines, "$EndElements"]) + "\n").encode()
