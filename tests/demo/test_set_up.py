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
from cohaptic_tools.demo.felt import PairForces
from cohaptic_tools.demo.set_up import describe_placement, serve_options
from cohaptic_tools.demo.settled import Placement


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
