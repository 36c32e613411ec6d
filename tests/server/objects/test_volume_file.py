"""Volume meshes that would silently become another body are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Ints
from cohaptic_server.objects.volume_file import read_volume

CUBE = 0.1 * np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], dtype=float)
TETS = np.array([[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]])


def write(path: Path, cells: list[tuple[str, Ints]]) -> Path:
    whole: Any = meshio.Mesh(CUBE, [*cells])
    whole.write(path)
    return path


@pytest.mark.parametrize(
    ("cells", "why"),
    [
        (
            [("tetra", TETS[:1]), ("hexahedron", np.array([[0, 1, 3, 2, 4, 5, 7, 6]]))],
            "would be lost: 1 of hexahedron",
        ),
        (
            [("tetra", TETS), ("wedge", np.array([[0, 1, 2, 4, 5, 6]] * 2))],
            "would be lost: 2 of wedge",
        ),
        ([("tetra", np.array([[0, 1, 2, 2]]))], "1 of 1 tetrahedra are flat"),
        ([("tetra", np.array([[0, 1, 2, 99]]))], "names vertex 99 of 8"),
        ([("triangle", np.array([[0, 1, 2]]))], "no tetrahedron in it, only: triangle"),
    ],
)
def test_what_would_be_another_body_is_refused(
    tmp_path: Path, cells: list[tuple[str, Ints]], why: str
) -> None:
    with pytest.raises(BodyError, match=why):
        read_volume(write(tmp_path / "c.vtu", cells))


_VTK = b"# vtk DataFile Version 4.1\nvtk output\nASCII\nDATASET "


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("surface.vtk", _VTK + b"POLYDATA\nPOINTS 0 double\n", "has a surface .* as STL or PLY"),
        ("grid.vtk", _VTK + b"STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n", r"STRUCTURED_POINTS\)"),
        ("other.msh", b"\x84\x00\x00\x00 of another program", "begin as Gmsh's files do"),
        ("text.vtk", b"nothing", r"no mesh that can be read"),
    ],
)
def test_a_file_of_another_form_is_told_what_to_become(
    name: str, content: bytes, said: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BodyError, match=said):
        read_volume(tmp_path / name)
    assert capfd.readouterr() == ("", "")
