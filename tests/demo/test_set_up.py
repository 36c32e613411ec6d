from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

from cohaptic.simulated.hand import Place
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.cli.serve import serve
from cohaptic_server.objects.inertia.inertia import Inertia
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.option import parse_values
from cohaptic_server.objects.parts.materials import PartMaterials
from cohaptic_server.testing.blocks import block
from cohaptic_tools.demo.felt import PairForces
from cohaptic_tools.demo.processes import placement_options
from cohaptic_tools.demo.scene import Scene
from cohaptic_tools.demo.set_up import describe_placement, serve_options, set_up
from cohaptic_tools.demo.settled import Placement

meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")


def silent(phase: str, share: float) -> None:
    """Nobody watches."""


def test_hands_are_put_on_an_object_and_it_is_said_what_they_feel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    mesh, path = block((0.06, 0.06, 0.14), (6, 6, 12)), tmp_path / "tower.vtk"
    meshio.Mesh(mesh.vertices + np.array((12.0, 0.0, 0.0)), [("tetra", mesh.tets)]).write(path)
    material = SolidSettings(order=1, contact_radius=0.012)
    wanted = ObjectFile(path, "z < 5%", material=material)
    body, scene, words = set_up(Scene(3), str(path), wanted, nonlinear=False, progress=silent)
    assert len(scene.places) == 3
    # A client is told a place in the frame of the object's file.
    assert scene.origin == body.mesh.origin == pytest.approx((12.0, 0.0, 0.07))
    options = placement_options(scene.script(0), scene.origin)
    at = [float(word) for word in options[1:4]]
    assert options[0] == "--at"
    assert at == pytest.approx(np.add(scene.places[0].point, scene.origin))
    assert scene.depth < Scene().depth
    assert words.startswith("left presses up to ")
    assert words.count("C_ij/C_ii") == 2
    for name in ("right is ", "user3 is "):
        assert name in words


@pytest.mark.parametrize(
    ("force", "felt", "words"),
    [
        (2.0, 0.3, "Left presses with 2 N and feels 0.3 N of right; right presses with 2 N and"),
        (0.01, 0.003, "No two places were found at which hands press with 0.5 to 5 N and feel 0.2"),
        (0.01, 0.003, "the best: left presses with 0.01 N and feels 0.003 N of right; right"),
        (0.0, 0.0, "feel 0.2 N of each other; hands slide off those that were tried."),
    ],
)
def test_it_is_told_whether_hands_feel_each_other(force: float, felt: float, words: str) -> None:
    place = Place((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    pair = PairForces(np.full(2, force), np.full(2, felt))
    placement = Placement((place, place), 0.01, (1.0, 0.1), (0.0, 0.05), pair)
    assert words in describe_placement(placement, ("left", "right"))


FULL = ObjectFile(
    Path("a.stl"),
    scale=0.01,
    edge=0.07,
    repair=True,
    material=SolidSettings(1e4, 0.3, 0.01, 1),
    fix_mesh=Path("bone.stl:mm:lps"),
    simplify=500,
    parts=PartMaterials((("left lobe", 3e3), ("a=b", 5e4)), (("a=b", 0.2),)),
    labels=("3=left lobe", "4"),
    inertia=Inertia(900.0, (("left lobe", 1100.0),), 0.3),
)


def test_the_server_gets_every_option() -> None:
    """What `serve` makes of them is the object that the demonstration compares with."""
    got = parsed(serve_options("a.stl", FULL, nonlinear=True))
    assert (got["nonlinear"], got["users"]) == (True, 2)
    assert (got["body"], got["fix"]) == ("a.stl", "")
    for field in fields(FULL):
        if field.name not in ("path", "material", "max_memory", "parts", "labels", "inertia"):
            assert got[field.name] == getattr(FULL, field.name)
    assert got["max_memory"] == FULL.max_memory / 1e9  # in GB on the command line
    (young, named), (nu, nu_named) = (
        parse_values(option, got[option]) for option in ("young", "poisson")
    )
    assert young is not None
    assert nu is not None
    assert PartMaterials(named, nu_named) == FULL.parts
    assert tuple(got["label"]) == FULL.labels
    densities = parse_values("--density", got["density"])
    assert Inertia(*densities, got["damping_ratio"]) == FULL.inertia
    material = SolidSettings(young, nu, got["contact_radius"], got["order"], FULL.material.cache)
    assert material == FULL.material
    ruled = replace(FULL, fix="z < 10%", fix_mesh=None, repair=False)
    got = parsed(serve_options("a.stl", ruled, nonlinear=False))
    assert (got["fix"], got["fix_mesh"], got["repair"]) == ("z < 10%", None, False)


def parsed(arguments: list[str]) -> dict[str, Any]:
    app = typer.Typer()
    app.command()(serve)
    command = typer.main.get_command(app)
    with command.make_context("serve", list(arguments)) as context:
        return dict(context.params)
