from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from cohaptic.errors import BodyError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.materials import PartMaterials
from cohaptic_server.objects.parts.nodes import read_surfaces
from cohaptic_server.objects.prepare import prepare
from shapes.solids import plate

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")

OUTER, INNER = 0.05, 0.02


def scene(path: Path, nodes: dict[str, Any]) -> Path:
    whole: Any = trimesh.Scene()
    for name, mesh in nodes.items():
        whole.add_geometry(mesh, node_name=name, geom_name=f"{name}-mesh")
    path.write_bytes(whole.export(file_type="glb"))
    return path


def ball(radius: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Any:
    x, faces = icosphere(2, radius)
    return trimesh.Trimesh(x + np.array(at), faces, process=False)


def box(low: float, high: float) -> Any:
    x, faces = plate(1.0, 1.0, 1)
    x = (x + np.array([0.5, 0.5, 0.0])) * np.array([0.06, 0.04, high - low])
    return trimesh.Trimesh(x + np.array([0.0, 0.0, low]), faces, process=False)


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


def test_closed_nodes_are_parts_and_others_are_one_surface(tmp_path: Path) -> None:
    flipped = ball(INNER)
    flipped.faces = flipped.faces[:, ::-1]
    parts = read_surfaces(scene(tmp_path / "a.glb", {"organ": ball(OUTER), "lump": flipped}))
    assert sorted(part.name for part in parts) == ["lump", "organ"]
    opened = ball(INNER)
    opened.faces = opened.faces[1:]
    (one,) = read_surfaces(scene(tmp_path / "b.glb", {"organ": ball(OUTER), "lump": opened}))
    assert one.name == ""
    assert len(one.faces) == 2 * 320 - 1
    (single,) = read_surfaces(scene(tmp_path / "c.glb", {"organ": ball(OUTER)}))
    assert single.name == ""
    pressed = ball(INNER)
    # Closed, but without a volume; it is sheared so that no two vertices come to lie on each other.
    pressed.vertices = pressed.vertices @ [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.1, 0.0]]
    (one,) = read_surfaces(scene(tmp_path / "d.glb", {"organ": ball(OUTER), "sign": pressed}))
    assert one.name == ""


def test_a_coordinate_that_is_no_number_is_found_in_any_part(tmp_path: Path) -> None:
    broken = ball(INNER)
    broken.vertices[7, 1] = np.nan
    with pytest.raises(BodyError, match="1 of 324 vertices have a coordinate that is not a number"):
        read_surfaces(scene(tmp_path / "a.glb", {"organ": ball(OUTER), "lump": broken}))


@pytest.mark.live
def test_what_lies_in_an_organ_has_its_own_material(tmp_path: Path) -> None:
    path = scene(tmp_path / "a.glb", {"organ": ball(OUTER), "lump": ball(INNER, (0.01, 0.0, 0.0))})
    source = ObjectFile(path, "z < 20%", edge=0.12, parts=PartMaterials((("lump", 1e5),)))
    built = build(source)
    assert built.parts is not None
    tets, moduli = built.solid.shape.tets, built.solid.shape.moduli
    middle = tets.vertices[tets.tets].mean(axis=1) - np.array([0.01, 0.0, 0.0])
    within = np.linalg.norm(middle, axis=1) < 0.95 * INNER
    beyond = np.linalg.norm(middle, axis=1) > 1.02 * INNER
    assert set(moduli.young[within]) == {1e5}
    assert set(moduli.young[beyond]) == {2e4}
    sizes = dict(zip(built.parts.names, built.parts.volumes(tets), strict=True))
    assert sizes["lump"] == pytest.approx(ball(INNER).volume, rel=0.05)
    assert sizes["organ"] == pytest.approx(ball(OUTER).volume - ball(INNER).volume, rel=0.02)
    assert built.prepared.deviation < 0.02 * OUTER
    again = build(replace(source, parts=PartMaterials()))
    assert again.prepared.parts is not None
    assert again.solid.shape.moduli.is_uniform


@pytest.mark.live
def test_parts_that_touch_become_one_body(tmp_path: Path) -> None:
    made = prepare(
        ObjectFile(scene(tmp_path / "a.glb", {"a": box(0.0, 0.02), "b": box(0.02, 0.05)}), edge=0.1)
    )
    assert made.parts is not None
    sizes = dict(zip(made.parts.names, made.parts.volumes(made.tets), strict=True))
    assert sizes["a"] == pytest.approx(0.06 * 0.04 * 0.02, rel=0.01)
    assert sizes["b"] == pytest.approx(0.06 * 0.04 * 0.03, rel=0.01)
