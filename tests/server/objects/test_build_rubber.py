from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from cohaptic.errors import BodyError
from cohaptic_server.bodies.rubber_solid import rubber_solid
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid, tick_seconds
from cohaptic_server.mesh.enclosed_volume import volume as volume_of
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.tetrahedra import quadratic
from cohaptic_server.objects.auto.resolve import resolve
from cohaptic_server.objects.build_rubber import TooFineError, affordable
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.objects.cost import Demand
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import VolumeLostError
from cohaptic_server.objects.store.store import load_or_prepare
from cohaptic_server.objects.surface import accept
from cohaptic_server.testing.blocks import block
from shapes.flawed import leaflet
from shapes.scene_files import parts_glb
from shapes.surface_files import stl
from tests.server.objects.files import write

pytestmark = pytest.mark.usefixtures("kernels")

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")
meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")


def torus(path: Path) -> Path:
    trimesh.creation.torus(  # pyright: ignore[reportUnknownMemberType]
        0.06, 0.025, major_sections=32, minor_sections=16
    ).export(path)
    return path


def volume(path: Path, cells: int) -> Path:
    mesh = block((0.1, 0.1, 0.1), (cells, cells, cells))
    meshio.Mesh(mesh.vertices, [("tetra", mesh.tets)]).write(path)
    return path


@pytest.mark.live
def test_a_surface_gets_a_mesh_that_the_tick_affords(tmp_path: Path) -> None:
    path = torus(tmp_path / "ring.stl")
    body = build_body(str(path), ObjectFile(path, "z < 20%"), nonlinear=True, damping=0.5)
    assert isinstance(body, RubberSolid)
    assert body.name == "ring"
    assert body.damping == 0.5
    nodes = len(body.shape.nodes)
    assert tick_seconds(nodes) <= 1.0 / 60.0
    assert nodes > 200
    assert body.shape.tets.volume == pytest.approx(2.0 * np.pi**2 * 0.06 * 0.025**2, rel=0.2)


@pytest.mark.live
def test_an_edge_that_is_too_short_is_refused_with_ways_out(tmp_path: Path) -> None:
    path = torus(tmp_path / "ring.stl")
    words = r"nodes under large deformation take about .* 60 Hz leave 16.7 ms. Take a larger --edge"
    with pytest.raises(BodyError, match=words):
        build_body(str(path), ObjectFile(path, "z < 20%", edge=0.1), nonlinear=True)


@pytest.mark.live
@pytest.mark.night
def test_what_coarse_elements_lose_is_told_of_the_tick_that_fine_ones_take(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that lose too much are too coarse, and those that keep it are too many."""
    monkeypatch.setattr(accept, "MAX_VOLUME_LOSS", 0.04)
    path = torus(tmp_path / "ring.stl")
    words = "large deformation take about .* a larger --edge than 0.[01].*, which loses thin parts"
    with pytest.raises(BodyError, match=words):
        build_body(str(path), ObjectFile(path, "z < 20%"), nonlinear=True)


@pytest.mark.live
def test_a_plate_below_the_envelope_of_a_large_edge_is_lost_there_and_not_flat(
    tmp_path: Path,
) -> None:
    """It was said to have no inside, where a shorter edge gave more nodes than a tick affords."""
    path = tmp_path / "plate.stl"
    trimesh.creation.box((0.2, 0.2, 0.003)).export(path)  # pyright: ignore[reportUnknownMemberType]
    sentence = (
        r"is there an inside\? What is thinner than about 23 mm is lost. Take a smaller --edge"
    )
    with pytest.raises(VolumeLostError, match=sentence):
        load_or_prepare(ObjectFile(path, fix="x < 3%", edge=0.4))
    crowd = Demand(users=16, nonlinear=True)
    with pytest.raises(TooFineError, match="nodes under large deformation"):
        affordable(ObjectFile(path, fix="x < 3%"), crowd, lambda phase, fraction: None)


@pytest.mark.live
def test_a_leaflet_is_no_lump_of_the_same_volume(tmp_path: Path) -> None:
    """25 tetrahedra had 98 % of the volume of a sheet of 1 mm, and ended 135 mm from its rim."""
    path = tmp_path / "leaflet.stl"
    path.write_bytes(stl(leaflet()))
    sentence = "mm from a part of the surface|are in .* pieces|of the volume|is there an inside"
    with pytest.raises(VolumeLostError, match=sentence):
        load_or_prepare(ObjectFile(path, "z < 15%", edge=0.15, simplify=4000))


@pytest.mark.live
def test_more_users_have_a_coarser_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rubber_solid, "cores", lambda: 1)
    source = ObjectFile(write(tmp_path / "ball.stl", *icosphere(3, 0.05)), "z < 20%")
    edges: list[float] = []
    for users in (2, 19):
        demand = Demand(users, 60.0, nonlinear=True)
        tried, _, held = affordable(source, demand, lambda phase, fraction: None)
        assert demand.affords(len(quadratic(held.tets)[0]))
        edges.append(tried.edge)
    assert edges[0] < edges[1]
    many = Demand(25, 60.0, nonlinear=True)
    with pytest.raises(BodyError, match=r"a larger --edge .* or fewer --users"):
        affordable(replace(source, edge=0.25), many, lambda phase, fraction: None)


@pytest.mark.live
@pytest.mark.night
def test_a_part_that_coarse_elements_lose_gets_finer_ones(tmp_path: Path) -> None:
    parts = {"organ": icosphere(2, 0.04), "lump": icosphere(1, 0.009)}
    path = tmp_path / "parts.glb"
    path.write_bytes(parts_glb(parts))
    source = ObjectFile(path, "z < 20%")
    with pytest.raises(VolumeLostError, match="of lump") as lost:
        load_or_prepare(replace(source, edge=0.5))
    assert lost.value.part == "lump"
    demand = Demand(nonlinear=True)
    found = resolve(source, demand=demand)
    tried, prepared, held = affordable(found.source, demand, lambda phase, fraction: None)
    assert not tried.repair
    assert tried.edge < 0.5
    assert prepared.parts is not None
    wanted = abs(volume_of(*parts["lump"]))
    k = prepared.parts.names.index("lump")
    assert prepared.parts.volumes(prepared.tets)[k] == pytest.approx(wanted, rel=0.2)
    assert demand.affords(len(quadratic(held.tets)[0])) or found.source.material.order == 1
