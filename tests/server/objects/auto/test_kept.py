"""What is lost of an object without a word of its owner is bounded; by his word it is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.auto.resolve import resolve
from cohaptic_server.objects.cost import Demand
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import VolumeLostError
from cohaptic_server.objects.store.store import load_or_prepare
from tests.server.objects.files import write

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")

THREAD = 2e-4  # m; its radius, far below what elements of this size can follow


def turned(path: Path, *profile: tuple[float, float]) -> Path:
    """A solid of revolution, by distances from its axis and heights [m]."""
    revolve: Any = getattr(trimesh.creation, "revolve")  # noqa: B009
    solid = revolve(np.array(profile), sections=24)
    return write(path, np.asarray(solid.vertices), np.asarray(solid.faces))


def ball(middle: float, radius: float) -> list[tuple[float, float]]:
    """Half a circle, but for its ends on the axis, upwards."""
    around: Floats = np.linspace(-0.5, 0.5, 14)[1:-1] * np.pi
    return [(radius * float(np.cos(a)), middle + radius * float(np.sin(a))) for a in around]


def on_a_thread(path: Path, second: float) -> Path:
    """A ball of 60 mm, and another over it at the other end of a thread of 60 mm."""
    above = 0.03 + 0.06 + second
    return turned(
        path, (0.0, -0.03), *ball(0.0, 0.03)[:-1], (THREAD, 0.03), (THREAD, above - second),
        *ball(above, second)[1:], (0.0, above + second),
    )  # fmt: skip


@pytest.mark.live
@pytest.mark.parametrize("demand", [None, Demand(2, 60.0, nonlinear=True)], ids=["solid", "rubber"])
def test_one_of_two_balls_is_not_taken_for_both_unasked(
    tmp_path: Path, demand: Demand | None
) -> None:
    source = ObjectFile(on_a_thread(tmp_path / "two.stl", 0.008), "z < 0", edge=0.1)
    with pytest.raises(VolumeLostError):
        load_or_prepare(source)
    sentence = (
        r"two.stl: .*, and what is left is not the object any more: 9\d% of its volume, up to 7"
    )
    with pytest.raises(BodyError, match=sentence):
        resolve(source, demand=demand)
    asked = resolve(replace(source, repair=True), demand=demand)
    assert load_or_prepare(asked.source).tets.volume > 0.0
