"""Valid volume meshes and label maps in each format.

Fluent's .msh is read through meshio. Other volumes are read by readers of our own, so that meshio
writes them; .vtk and .vtu are also written here from their specifications. The voxels of NIfTI and
NRRD are read by our own code behind headers that nibabel and pynrrd read; their files are written
here.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator
from typing import Any

import meshio
import numpy as np

from fuzzing.drafts import Draft, gzipped, header_and_gzipped
from fuzzing.shapes import SIDE, VOXEL, Block, block, voxels
from fuzzing.surface_files import by_meshio
from fuzzing.vtu import FORMS, Piece, VtuWriter

_BLOCKS = (block((1, 1, 1)), block((3, 2, 2)))


def _grouped(one: Block) -> Any:
    """The tetrahedra as two blocks of cells, each a group with a name."""
    parts = [one.groups == tag for tag in (1, 7)]
    data: list[Any] = [one.groups[part] for part in parts]
    return meshio.Mesh(
        one.x,
        [("tetra", one.tets[part]) for part in parts],
        cell_data={"gmsh:physical": data, "gmsh:geometrical": data},
        field_data={"liver": np.array([1, 3]), "tumour": np.array([7, 3])},
    )


def _plain(one: Block) -> Any:
    return meshio.Mesh(one.x, [("tetra", one.tets)], cell_data={"material": [one.groups]})


def _quadratic(one: Block) -> Any:
    """Ten-node tetrahedra, with triangles and lines beside them."""
    x, tets = one.quadratic()
    cells: list[Any] = [("tetra10", tets), ("triangle", tets[:, :3]), ("line", tets[:, :2])]
    return meshio.Mesh(x, cells)


def _rows(rows: Any, before: str = "") -> str:
    return "".join(f"{before}{' '.join(map(str, row))}\n" for row in rows.tolist())


def msh() -> Iterator[Draft]:
    """Gmsh's versions 2.2, 4.0 and 4.1, text and binary, and a mesh of Fluent."""
    for one in _BLOCKS:
        for form in ("gmsh22", "gmsh"):
            for binary in (False, True):
                # In 4.1 meshio writes groups for a mesh with entities only.
                mesh = _grouped(one) if form == "gmsh22" else _plain(one)
                data = by_meshio(".msh", mesh, form, binary=binary)
                name = f"{form} {'binary' if binary else 'text'} {len(one.tets)}"
                yield Draft(name, (data,), one.volume)
    one = _BLOCKS[1]
    data = by_meshio(".msh", _quadratic(one), "gmsh22", binary=True)
    yield Draft("quadratic", (data,), one.volume)
    for binary in (False, True):
        plain = meshio.Mesh(one.x, [("tetra", one.tets)])
        data = by_meshio(".msh", plain, "ansys", binary=binary)
        yield Draft(f"ansys {'binary' if binary else 'text'}", (data,), one.volume)
        # meshio cannot read the cell data that it writes to the text form of 4.0.
        mesh = _grouped(one) if binary else plain
        data = by_meshio(".msh", mesh, "gmsh40", binary=binary)
        yield Draft(f"gmsh40 {'binary' if binary else 'text'}", (data,), one.volume)
    nodes = np.column_stack([10 * np.arange(len(one.x)) + 5, one.x])
    count = len(one.tets)
    elements = np.column_stack([np.arange(count) + 1, 10 * one.tets + 5])
    text = (
        f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 3 0\n"
        f"$EndEntities\n$Nodes\n1 {len(one.x)} 5 {10 * len(one.x)}\n3 1 0 {len(one.x)}\n"
        + "".join(f"{int(tag)}\n" for tag in nodes[:, 0])
        + _rows(nodes[:, 1:])
        + f"$EndNodes\n$Elements\n1 {count} 1 {count}\n3 1 4 {count}\n"
        + f"{_rows(elements)}$EndElements\n"
    )
    yield Draft("gmsh41 sparse tags", (text.encode(),), one.volume)


def vtk() -> Iterator[Draft]:
    """Versions 4.2 and 5.1, text and binary; 3.0 is written here, with points in double."""
    for one in _BLOCKS:
        for form in ("vtk42", "vtk"):  # the second is 5.1
            for binary in (False, True):
                data = by_meshio(".vtk", _plain(one), form, binary=binary)
                name = f"{form} {'binary' if binary else 'text'} {len(one.tets)}"
                yield Draft(name, (data,), one.volume)
    one = _BLOCKS[1]
    yield Draft("quadratic", (by_meshio(".vtk", _quadratic(one), "vtk42"),), one.volume)
    count = len(one.tets)
    text = (
        "# vtk DataFile Version 3.0\na block\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS {len(one.x)} double\n{_rows(one.x)}CELLS {count} {5 * count}\n"
        f"{_rows(one.tets, '4 ')}CELL_TYPES {count}\n{'10 ' * count}\nCELL_DATA {count}\n"
        f"SCALARS material int 1\nLOOKUP_TABLE default\n{' '.join(map(str, one.groups))}\n"
    )
    yield Draft("vtk30", (text.encode(),), one.volume)


def vtu() -> Iterator[Draft]:
    """Text, base64 with and without compression; and pieces in every form of their arrays."""
    for one in _BLOCKS:
        for name, options in (
            ("text", {"binary": False}),
            ("base64", {"compression": None}),
            ("zlib", {"compression": "zlib"}),
        ):
            data = by_meshio(".vtu", _plain(one), "vtu", **options)
            yield Draft(f"{name} {len(one.tets)}", (data,), one.volume)
    one = _BLOCKS[1]
    yield Draft("quadratic", (by_meshio(".vtu", _quadratic(one), "vtu"),), one.volume)
    pieces: list[Piece] = []
    for tag in (1, 7):
        used, cells = np.unique(one.tets[one.groups == tag], return_inverse=True)
        corners: list[list[int]] = cells.reshape(-1, 4).tolist()
        region = {"region": np.full(len(corners), tag)}
        pieces.append(Piece(one.x[used], corners, [10] * len(corners), region))
    for form, order in itertools.product(FORMS, "<>"):
        writer = VtuWriter(form, order, "u8", "" if form == "ascii" else "vtkZLibDataCompressor")
        yield Draft(f"pieces {form} {order}", (writer.written(pieces),), one.volume)


_MM = 1e3 * VOXEL  # side of a voxel in a file [mm]


def _nifti(values: Any, code: int, order: str = "<") -> tuple[bytes, bytes]:
    """Header and voxels of a NIfTI file of the first version."""
    head = bytearray(352)

    def put(at: int, kind: str, *numbers: float) -> None:
        struct.pack_into(order + kind, head, at, *numbers)

    put(0, "i", 348)
    put(40, "8h", 3, *values.shape, 1, 1, 1, 1)
    put(70, "hh", code, 8 * values.dtype.itemsize)
    put(76, "8f", 1.0, _MM, _MM, _MM, 0.0, 0.0, 0.0, 0.0)
    put(108, "f", 352.0)
    put(123, "b", 2)  # mm
    put(254, "h", 1)  # the place is that of the three rows below
    for row in range(3):
        put(280 + 16 * row, "4f", *(_MM * np.eye(3, 4)[row]))
    head[344:348] = b"n+1\0"
    return bytes(head), values.astype(values.dtype.newbyteorder(order)).tobytes(order="F")


def _nifti_2(values: Any) -> tuple[bytes, bytes]:
    """Header and voxels of the second version, with its place as a quaternion."""
    head = bytearray(544)
    struct.pack_into("<i8s2h", head, 0, 540, b"n+2\0\r\n\x1a\n", 2, 8)
    struct.pack_into("<8q", head, 16, 3, *values.shape, 1, 1, 1, 1)
    struct.pack_into("<8d", head, 104, 1.0, _MM, _MM, _MM, 0.0, 0.0, 0.0, 0.0)
    struct.pack_into("<q", head, 168, 544)
    struct.pack_into("<2i6d", head, 344, 1, 0, 0.5, 0.5, 0.5, 1.0, 2.0, 3.0)
    struct.pack_into("<i", head, 500, 2)  # mm
    return bytes(head), values.tobytes(order="F")


def _scans() -> Iterator[tuple[str, Any, float]]:
    """A name, the voxels, and the volume of all labels [m^3]."""
    for labels in (1, 2):
        values = voxels(labels)
        yield f"{labels} labels", values, float((values > 0).sum()) * VOXEL**3


_TYPES = (("u1", 2, "uint8"), ("i2", 4, "short"), ("f4", 16, "float"), ("i4", 8, "int"))
_SMOOTH = 0.02  # share of the volume by which smoothing changes a ball of few voxels


def nii() -> Iterator[Draft]:
    """Voxels of each type, in both orders of bytes, with one label and two."""
    for name, values, volume in _scans():
        for kind, code, _ in _TYPES:
            for order in "<>":
                pieces = _nifti(values.astype(kind), code, order)
                yield Draft(f"{name} {order}{kind}", pieces, volume, within=_SMOOTH)
        yield Draft(f"{name} second version", _nifti_2(values), volume, within=_SMOOTH)


def nii_gz() -> Iterator[Draft]:
    """The same, packed."""
    for name, values, volume in _scans():
        for kind, code, _ in _TYPES:
            pieces = _nifti(values.astype(kind), code)
            yield Draft(f"{name} {kind}", pieces, volume, gzipped, _SMOOTH)


def _nrrd(kind: str, sizes: str, encoding: str, place: str) -> bytes:
    return (
        f"NRRD0004\n# made by hand\ntype: {kind}\ndimension: {len(sizes.split())}\nsizes: {sizes}\n"
        f"endian: little\nencoding: {encoding}\n{place}\n\n"
    ).encode()


def nrrd() -> Iterator[Draft]:
    """Raw and packed, with a place in space or spacings only, and the names of 3D Slicer."""
    spaced = f"spacings: {_MM} {_MM} {_MM}"
    placed = (
        "space: left-posterior-superior\nspace directions:"
        f" ({_MM},0,0) (0,{_MM},0) (0,0,{_MM})\nspace origin: (1,2,3)"
    )
    named = "\nSegment0_ID:=a\nSegment0_LabelValue:=1\nSegment0_Name:=liver"
    layered = (
        f"space: RAS\nspace directions: none ({_MM / 10},0,0) (0,{_MM / 10},0) (0,0,{_MM / 10})\n"
        'kinds: list domain domain domain\nspace units: "cm" "cm" "cm"\nspace origin: (0,0,0)'
    )
    for name, values, volume in _scans():
        head = _nrrd("uchar", f"1 {SIDE} {SIDE} {SIDE}", "raw", layered)
        pieces = head, values.tobytes(order="F")
        yield Draft(f"{name} in a layer", pieces, volume, within=_SMOOTH)
        for kind, _, word in _TYPES:
            for encoding, place in (("raw", spaced), ("gzip", placed), ("gzip", placed + named)):
                head = _nrrd(word, f"{SIDE} {SIDE} {SIDE}", encoding, place)
                pieces = head, values.astype(f"<{kind}").tobytes(order="F")
                form = f"{name} {kind} {encoding}"
                if encoding == "raw":
                    yield Draft(form, pieces, volume, within=_SMOOTH)
                else:
                    yield Draft(form, pieces, volume, header_and_gzipped, _SMOOTH)
