from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Ints
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.materials import PartMaterials
from cohaptic_server.objects.volume_file import read_volume
from cohaptic_server.testing.blocks import block

meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")

BAR = block((0.2, 0.04, 0.04), (6, 2, 2))
FAR: Ints = (BAR.vertices[BAR.tets].mean(axis=1)[:, 0] > 0.0).astype(np.int64)


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


def gmsh(path: Path, named: bool = True) -> Path:
    tags = (7 + FAR).astype(np.int64)
    data: Any = {"gmsh:physical": [tags], "gmsh:geometrical": [tags]}
    field: Any = {"near": np.array([7, 3]), "far": np.array([8, 3]), "skin": np.array([1, 2])}
    mesh = meshio.Mesh(
        BAR.vertices, [("tetra", BAR.tets)], cell_data=data, field_data=field if named else {}
    )
    meshio.write(path, mesh, file_format="gmsh22")
    return path


def vtu(path: Path, values: Any, name: str = "MaterialIds") -> Path:
    cells = [("tetra", BAR.tets)]
    meshio.write(path, meshio.Mesh(BAR.vertices, cells, cell_data={name: [values]}))
    return path


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (0.5 * FAR, "'MaterialIds' should number the parts"),
        (np.full(len(FAR), np.nan), "should number the parts"),
        (np.arange(len(FAR)), "has 144 different values; parts with materials of their own may be"),
        (1e300 * FAR, "numbers beyond 2"),
    ],
)
def test_cell_data_that_numbers_nothing_is_refused(tmp_path: Path, values: Any, words: str) -> None:
    with pytest.raises(BodyError, match=words):
        read_volume(vtu(tmp_path / "a.vtu", values))


def test_a_bar_of_two_groups_gives_way_like_springs_in_series(tmp_path: Path) -> None:
    """Through the cut of the held region, whose pieces keep the group that they come from."""
    path = gmsh(tmp_path / "a.msh")
    materials = PartMaterials((("near", 1e5), ("far", 1e4)), (("near", 0.0), ("far", 0.0)))
    source = ObjectFile(path, "x < 10%", parts=materials)
    built = build(source)
    shape = built.solid.shape
    assert len(shape.tets.tets) > len(BAR.tets)
    middle = shape.tets.vertices[shape.tets.tets].mean(axis=1)[:, 0]
    assert np.array_equal(shape.moduli.young, np.where(middle > 0.0, 1e4, 1e5))
    x = shape.mesh.vertices
    end = shape.mesh.faces[(x[shape.mesh.faces][:, :, 0] > 0.0999).all(axis=1)]
    area = np.linalg.norm(face_area_vectors(x, end), axis=1)
    each = np.repeat(area / area.sum() / 3.0, 3)
    fraction = np.bincount(end.ravel(), each, len(x)).astype(np.float64)
    pull = fraction[:, None, None] * np.array([1.0, 0.0, 0.0])[:, None]
    moved = fraction @ built.solid.columns.respond(np.arange(len(x)), pull).reshape(-1, 3)[:, 0]
    springs = (0.08 / 1e5 + 0.1 / 1e4) / 0.04**2
    assert moved == pytest.approx(springs, rel=0.03)


def test_a_change_of_one_material_is_prepared_anew(tmp_path: Path) -> None:
    path = gmsh(tmp_path / "a.msh")
    softest = [
        build(ObjectFile(path, "x < 10%", parts=PartMaterials((("far", young),))))
        .solid.vertex_compliance()
        .max()
        for young in (2e4, 2e3, 2e4)
    ]
    assert softest[1] > 2.0 * softest[0]
    assert softest[2] == pytest.approx(softest[0], rel=1e-12)
