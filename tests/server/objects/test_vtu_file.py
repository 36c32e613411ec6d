"""All pieces and cells of a `.vtu` are read in every form of its arrays, or the file is refused."""

from __future__ import annotations

import base64
import itertools
import re
import struct
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import volumes
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.volume_file import VolumeMesh, read_volume
from cohaptic_server.testing.blocks import block
from fuzzing.vtu import FORMS, PACKERS, Piece, VtuWriter

BAR = block((0.12, 0.06, 0.06), (4, 2, 2))
VOLUME = 0.12 * 0.06 * 0.06  # m^3
ALL: Ints = np.arange(len(BAR.tets))
FAR: Ints = (BAR.vertices[BAR.tets].mean(axis=1)[:, 0] > 0.0).astype(np.int64)


def piece(chosen: Ints, x: Floats = BAR.vertices, tets: Ints = BAR.tets, **data: Any) -> Piece:
    """Some of the tetrahedra, with points of their own."""
    used, corners = np.unique(tets[chosen], return_inverse=True)
    cells: list[list[int]] = corners.reshape(-1, 4).tolist()
    return Piece(x[used], cells, [10] * len(cells), data)


def halves() -> list[Piece]:
    return [piece(ALL[half == FAR], material=FAR[half == FAR]) for half in (0, 1)]


def read(tmp_path: Path, data: bytes) -> VolumeMesh:
    path = tmp_path / "a.vtu"
    path.write_bytes(data)
    return read_volume(path)


def volume(mesh: VolumeMesh) -> float:
    return float(np.abs(volumes(mesh.x, mesh.tets)).sum())


def refused(tmp_path: Path, data: bytes, words: str) -> None:
    with pytest.raises(BodyError, match=words) as error:
        read(tmp_path, data)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("form", "order", "header", "packer"),
    [
        one
        for one in itertools.product(FORMS, "<>", ("u4", "u8"), PACKERS)
        if one[0] != "ascii" or not one[3]
    ],
)
def test_every_form_of_the_arrays_is_read(
    form: str, order: str, header: str, packer: str, tmp_path: Path
) -> None:
    empty = Piece(np.zeros((0, 3)), [], [])
    mesh = read(tmp_path, VtuWriter(form, order, header, packer).written([*halves(), empty]))
    assert volume(mesh) == pytest.approx(VOLUME, rel=1e-9)
    assert mesh.parts is not None
    assert mesh.parts.names == ("0", "1")
    assert np.array_equal(mesh.parts.of, mesh.x[mesh.tets].mean(axis=1)[:, 0] > 0.0)


def test_pieces_hang_together_by_the_points_of_their_borders(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Each process of a solver writes them, and in single precision not quite at one place."""
    near, far = halves()
    far = Piece((far.x + 1e-9).astype(np.float32).astype(np.float64), far.cells, far.types)
    mesh = read(tmp_path, VtuWriter().written([near, far]))
    assert len(mesh.x) == len(BAR.vertices)
    assert volume(mesh) == pytest.approx(VOLUME, rel=1e-6)
    assert "are merged" in caplog.text
    assert "'material' is not in all pieces" in caplog.text


def test_cells_that_two_pieces_share_count_once(tmp_path: Path) -> None:
    """Ghost cells, with which a process sees over its border."""
    ghosts = np.flatnonzero(BAR.vertices[BAR.tets].mean(axis=1)[:, 0] < 0.03)
    mesh = read(tmp_path, VtuWriter().written([halves()[1], piece(ghosts)]))
    assert volume(mesh) == pytest.approx(VOLUME, rel=1e-9)


# VTK's type, number of points, and the words for it.
SOLIDS = ((11, 8, "voxel"), (12, 8, "hexahedron"), (13, 6, "wedge"), (14, 5, "pyramid"),
          (15, 10, "pentagonal prism"), (16, 12, "hexagonal prism"), (25, 20, "quadratic hexa"),
          (29, 27, "triquadratic"), (33, 24, "VTK's type 33"), (41, 9, "convex point set"),
          (42, 4, "polyhedron"), (72, 27, "Lagrange hexahedron"), (79, 8, "Bezier hexahedron"),
          (99, 4, "VTK's type 99"))  # fmt: skip


@pytest.mark.parametrize(("kind", "points", "name"), SOLIDS)
@pytest.mark.parametrize("first", [False, True])
@pytest.mark.parametrize("apart", [False, True])
def test_no_cell_with_a_volume_is_lost(
    kind: int, points: int, name: str, first: bool, apart: bool, tmp_path: Path
) -> None:
    """Whether it comes before the tetrahedra or behind, in their piece or another."""
    near, far = halves()
    solid = [list(range(points))]
    cells = [*solid, *near.cells] if first else [*near.cells, *solid]
    types = [kind, *near.types] if first else [*near.types, kind]
    mixed = [Piece(near.x, cells, types), far]
    lone = [Piece(np.ones((points, 3)), solid, [kind]), near, far]
    words = f"would be lost: 1 of {name}.*ParaView by Filters, Tetrahedralize"
    refused(tmp_path, VtuWriter().written(lone if apart else mixed), words)


@pytest.mark.parametrize("kind", [1, 2, 3, 4, 5, 7, 9, 21, 22, 34, 36, 61, 69, 76])
def test_cells_without_a_volume_may_stand_beside(kind: int, tmp_path: Path) -> None:
    near, far = halves()
    more = Piece(near.x, [[0, 1, 2], *near.cells], [kind, *near.types])
    assert volume(read(tmp_path, VtuWriter().written([more, far]))) == pytest.approx(VOLUME)


@pytest.mark.parametrize(("kind", "nodes"), [(24, 10), (71, 20), (71, 4), (78, 10), (64, 10)])
def test_of_curved_tetrahedra_the_corners_are_taken(kind: int, nodes: int, tmp_path: Path) -> None:
    near, far = halves()
    cells = [[*cell, *range(nodes - 4)] for cell in near.cells]
    curved = Piece(near.x, cells, [kind] * len(cells))
    assert volume(read(tmp_path, VtuWriter().written([curved, far]))) == pytest.approx(VOLUME)


TEXT = VtuWriter().written(halves()).decode()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"UnstructuredGrid"', '"PUnstructuredGrid"', "only names the files .* as one .vtu"),
        ('"UnstructuredGrid"', '"PolyData"', "it has a surface"),
        ('"UnstructuredGrid"', '"ImageData"', "it is a ImageData"),
        ("<Piece ", "<Peace ", "an element 'Peace', which is unknown|mismatched"),
        ("NumberOfCells=", "NumberOfCell=", "no mesh that can be read"),
        ('NumberOfCells="48"', 'NumberOfCells="47"', "'offsets' has 48 numbers of 47"),
        ('NumberOfCells="48"', 'NumberOfCells="9999999999999"', "numbers of 9,999,999,999,999"),
        ('NumberOfCells="48"', 'NumberOfCells="-1"', "-1 cells"),
        ('Name="types"', 'Name="kinds"', "no mesh that can be read"),
        ('Name="types"', 'Name="offsets"', "two arrays 'offsets'"),
        ('format="ascii"', 'format="morse"', "has the format 'morse'"),
        ('type="Float64"', 'type="Float128"', "numbers of the type 'Float128'"),
        ("<UnstructuredGrid>", "<UnstructuredGrid/><UnstructuredGrid>", "has 2 elements"),
        ("<VTKFile", "<!DOCTYPE a [<!ENTITY b 'c'>]><VTKFile", "declares entities"),
        ("<VTKFile", '<VTKFile compressor="vtkLZ4DataCompressor"', "compressor ZLib or none"),
    ],
)
def test_what_does_not_fit_together_is_refused(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    assert old in TEXT
    once = TEXT.replace(old, new, 1)
    if "Peace" in new:
        once = once.replace("</Piece>", "</Peace>", 1)
    refused(tmp_path, once.encode(), words)


def test_of_a_bomb_no_more_is_unpacked_than_its_header_says(tmp_path: Path) -> None:
    """A block of 48 types that has a hundred megabytes, 100 kB when packed."""
    bomb = zlib.compress(bytes(10**8))
    head = base64.b64encode(struct.pack("<4I", 1, 48, 0, len(bomb)))
    packed = (head + base64.b64encode(bomb)).decode()
    types = r'(Name="types" NumberOfComponents="1" format=)"ascii">[^<]*'
    text = re.sub(types, rf'\1"binary">{packed}', TEXT, count=1)
    text = text.replace("<VTKFile", '<VTKFile compressor="vtkZLibDataCompressor"')
    tracemalloc.start()
    try:
        mesh = read(tmp_path, text.encode())  # 48 cells of type 0, which are empty, and one piece
        assert tracemalloc.get_traced_memory()[1] < 10**7
    finally:
        tracemalloc.stop()
    assert volume(mesh) == pytest.approx(0.5 * VOLUME)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.9, 0.99])
def test_what_is_cut_off_is_refused(form: str, fraction: float, tmp_path: Path) -> None:
    data = VtuWriter(form).written(halves())
    refused(tmp_path, data[: int(fraction * len(data))], "no mesh that can be read|is empty")


def test_points_that_are_no_numbers_are_refused(tmp_path: Path) -> None:
    text = re.sub(r'(Name="Points"[^>]*>\s*)\S+', r"\1nan", TEXT)
    refused(tmp_path, text.encode(), "a coordinate that is not a number")
