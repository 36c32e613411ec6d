from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.auto.diagnose import FEWER, MANY, diagnose
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import PartSurface

SOURCE = ObjectFile(Path("a.stl"))


def one(x: Floats, faces: Ints) -> tuple[PartSurface]:
    """A surface of no parts."""
    return (PartSurface("", x, faces),)


def two(gap: float) -> tuple[Floats, Ints]:
    """Two balls of radius 0.05 beside each other."""
    x, faces = icosphere(2, 0.05)
    beside = x + np.array([0.1 + gap, 0.0, 0.0])
    return np.concatenate([x, beside]), np.concatenate([faces, faces + len(x)])


def used(x: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Without the vertices that no triangle has, as a file is read."""
    numbers, renamed = np.unique(faces, return_inverse=True)
    return x[numbers], renamed.reshape(-1, 3)


def test_what_is_given_is_not_found_again() -> None:
    source = ObjectFile(Path("a.stl"), "z < 10%", 0.5, repair=True, simplify=500, shell=0.01)
    x, faces = icosphere(4, 30.0)
    assert diagnose(source, one(x, faces[:-1])).remedies == ()
    assert diagnose(source, one(x, faces[:-1])).source == source


def test_a_closed_surface_in_a_plane_is_refused_at_once() -> None:
    x, faces = icosphere(2, 0.05)
    pressed = one(x * [1.0, 1.0, 0.0], faces)
    with pytest.raises(BodyError, match=r"a\.stl: the surface encloses no volume .* --shell"):
        diagnose(SOURCE, pressed)
    diagnose(ObjectFile(Path("a.stl"), shell=0.01), pressed)


def test_everything_is_found_at_once() -> None:
    x, faces = icosphere(5, 60.0)
    found = diagnose(SOURCE, one(x, faces[:-3]))
    assert len(faces) > MANY
    options = [remedy.option.split()[0] for remedy in found.remedies]
    assert options == ["--scale", "--simplify", "--repair", "--fix"]
    chosen = found.source
    assert (chosen.scale, chosen.simplify, chosen.repair) == (1e-3, FEWER, True)
    assert [remedy.option.split()[0] for remedy in found.needed] == ["--scale", "--repair", "--fix"]


def test_half_a_ball_is_a_sheet_and_a_ball_with_a_hole_is_not() -> None:
    x, faces = icosphere(3, 0.05)
    height = x[faces].mean(axis=1)[:, 2]
    half, holed = (diagnose(SOURCE, one(*used(x, faces[height < h]))).source for h in (0.0, 0.045))
    assert half.shell == pytest.approx(0.03 * 0.1)
    assert half.repair is False
    assert (holed.shell, holed.repair) == (0.0, True)


@pytest.mark.parametrize("gap", [-0.03, 0.03])
def test_two_balls_need_repair_whether_they_cross_or_not(gap: float) -> None:
    found = diagnose(SOURCE, one(*two(gap)))
    assert found.source.repair is True
    words = " ".join(remedy.problem for remedy in found.remedies)
    assert ("cross" in words) == (gap < 0.0)
    assert "in 2 pieces" in words
