"""Volume meshes that would silently become another body are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Ints
from cohaptic_server.objects.volume_file import VOLUMES, read_volume

CUBE = 0.1 * np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], dtype=float)
TETS = np.array([[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]])


def write(path: Path, cells: list[tuple[str, Ints]]) -> Path:
    whole: Any = meshio.Mesh(CUBE, [*cells])
    whole.write(path)
    return path


@pytest.mark.parametrize("kind", VOLUMES)
def test_tetrahedra_are_read_as_they_are(tmp_path: Path, kind: str) -> None:
    x, tets, _ = read_volume(write(tmp_path / f"cube{kind}", [("tetra", TETS)]))
    assert x == pytest.approx(CUBE)
    assert tets.tolist() == TETS.tolist()


def test_faces_beside_them_do_not_matter(tmp_path: Path) -> None:
    triangles = np.array([[0, 1, 2]])
    _, tets, _ = read_volume(write(tmp_path / "c.vtu", [("triangle", triangles), ("tetra", TETS)]))
    assert len(tets) == len(TETS)


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
        ([("tetra", np.concatenate([TETS, TETS[2:3, ::-1]]))], "1 tetrahedra are there more than"),
        ([("tetra", np.array([[0, 1, 2, 2]]))], "1 tetrahedra name a vertex twice"),
        ([("tetra", np.array([[0, 1, 2, 99]]))], "names vertex 99 of 8"),
        ([("triangle", np.array([[0, 1, 2]]))], "no tetrahedron in it, only: triangle"),
    ],
)
def test_what_would_be_another_body_is_refused(
    tmp_path: Path, cells: list[tuple[str, Ints]], why: str
) -> None:
    with pytest.raises(BodyError, match=why):
        read_volume(write(tmp_path / "c.vtu", cells))
