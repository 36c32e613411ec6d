"""Bytes of STL, PLY, OBJ and OFF files, in the variants that programs write."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints
from shapes.grids import Mesh


def stl(mesh: Mesh, note: str = "cohaptic example, metres") -> bytes:
    """The bytes of a binary STL file."""
    x, faces = mesh
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
    table = np.zeros(len(faces), dtype=record)
    table["normal"] = _normals(mesh)
    table["corners"] = x[faces]
    return note.encode().ljust(80, b" ") + len(faces).to_bytes(4, "little") + table.tobytes()


def ascii_stl(mesh: Mesh, name: str, encoding: str) -> bytes:
    """The bytes of an STL file in text, as old programs write it.

    Args:
        mesh: The surface.
        name: Name of the solid.
        encoding: Encoding of the text.
    """
    x, faces = mesh
    lines = [f"solid {name}"]
    for n, corners in zip(_normals(mesh), x[faces], strict=True):
        lines.append(f"facet normal {n[0]:.6e} {n[1]:.6e} {n[2]:.6e}\n outer loop")
        lines += [f"  vertex {p[0]:.6e} {p[1]:.6e} {p[2]:.6e}" for p in corners]
        lines.append(" endloop\nendfacet")
    return "\n".join([*lines, f"endsolid {name}\n"]).encode(encoding)


def ply(mesh: Mesh) -> bytes:
    """The bytes of a binary PLY file."""
    x, faces = mesh
    head = _ply_head(
        "binary_little_endian",
        len(x),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
    )
    table = np.zeros(len(faces), dtype=np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    table["count"], table["corners"] = 3, faces
    return head + x.astype("<f4").tobytes() + table.tobytes()


def quad_ply(x: Floats, quads: Ints) -> bytes:
    """The bytes of a PLY file in text, of quadrilaterals.

    Args:
        x: Vertices, shape (n, 3).
        quads: Corners in order, shape (m, 4).
    """
    head = _ply_head(
        "ascii", len(x), f"element face {len(quads)}", "property list uchar int vertex_index"
    )
    return head + (_rows(x) + "".join(f"4 {a} {b} {c} {d}\n" for a, b, c, d in quads)).encode()


def strip_ply(x: Floats, strips: list[list[int]]) -> bytes:
    """The bytes of a PLY file of one list of triangle strips, as the archive at Stanford has it.

    Args:
        x: Vertices, shape (n, 3).
        strips: Vertices of each strip; -1 parts them in the file.
    """
    run = [k for strip in strips for k in (*strip, -1)]
    head = _ply_head("ascii", len(x), "element tristrips 1", "property list int int vertex_indices")
    return head + (_rows(x) + f"{len(run)} {' '.join(map(str, run))}\n").encode()


def seamed_obj(x: Floats, quads: Ints, columns: int) -> bytes:
    """The bytes of an OBJ file of quadrilaterals, with texture coordinates, normals and groups.

    Along the texture's seam there are two vertices at each place, as exporters write them.

    Args:
        x: Vertices of a grid that closes on itself both ways, shape (rows columns, 3).
        quads: Corners in order, shape (m, 4), the last `columns` of them at the seam.
        columns: Number of columns of the grid.
    """
    n = len(x)
    seam = quads[-columns:].copy()
    seam[seam < columns] += n  # the copies of the first row stand at the end
    lines = ["# cohaptic example, metres", "mtllib none.mtl", "o part"]
    lines += [f"v {a:.7f} {b:.7f} {c:.7f}" for a, b, c in np.concatenate([x, x[:columns]])]
    lines += [f"vt {k % columns / columns:.5f} {k // columns * columns / n:.5f}" for k in range(n)]
    lines += [f"vt {k / columns:.5f} 1.00000" for k in range(columns)]
    lines += ["vn 0 0 1", "usemtl skin", "s 1"]
    for group, rows in (("body", quads[:-columns]), ("seam", seam)):
        lines.append(f"g {group}")
        lines += ["f " + " ".join(f"{k + 1}/{k + 1}/1" for k in row) for row in rows.tolist()]
    return ("\n".join(lines) + "\n").encode()


def off(mesh: Mesh) -> bytes:
    """The bytes of an OFF file."""
    x, faces = mesh
    rows = "".join(f"3 {a} {b} {c}\n" for a, b, c in faces.tolist())
    return (f"OFF\n{len(x)} {len(faces)} 0\n" + _rows(x) + rows).encode()


def _normals(mesh: Mesh) -> Floats:
    areas = face_area_vectors(*mesh)
    return np.asarray(areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-30))


def _rows(x: Floats) -> str:
    return "".join(f"{a:.7f} {b:.7f} {c:.7f}\n" for a, b, c in x.tolist())


def _ply_head(form: str, vertices: int, *element: str) -> bytes:
    lines = [
        "ply",
        f"format {form} 1.0",
        "comment cohaptic example, metres",
        f"element vertex {vertices}",
        *(f"property float {axis}" for axis in "xyz"),
        *element,
        "end_header\n",
    ]
    return "\n".join(lines).encode()
