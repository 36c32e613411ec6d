from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.tetrahedra import boundary
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.auto.diagnose import Side, flat_fraction, likely_base
from cohaptic_server.objects.fix_rule import fixed_by_rule
from cohaptic_server.testing.blocks import block


def box(
    size: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[Floats, Ints]:
    """A box whose foot is centred on a place."""
    tets = block(size, (4, 4, 4))
    return tets.vertices + np.array(at), boundary(tets.tets)


def test_a_box_rests_on_the_whole_of_each_side() -> None:
    x, faces = box((1.0, 2.0, 3.0))
    for axis in range(3):
        for sign in (-1, 1):
            assert flat_fraction(x, faces, Side(axis, sign)) == pytest.approx(1.0)


def test_half_a_ball_is_held_at_its_flat_side_wherever_that_is() -> None:
    x, faces = icosphere(3, 1.0)
    x[:, 0] = np.minimum(x[:, 0], 0.3)  # flat towards +x
    rule, words = likely_base(x, faces, ".stl")
    assert (rule[:3], words) == ("x >", "its flattest side is held")


def test_a_table_is_held_at_its_feet() -> None:
    corners = [(a, b, 0.0) for a in (-0.4, 0.4) for b in (-0.4, 0.4)]
    legs = [box((0.1, 0.1, 0.9), corner) for corner in corners]
    parts = [box((1.0, 1.0, 0.1), (0.0, 0.0, 0.9)), *legs]
    starts = np.cumsum([0, *(len(x) for x, _ in parts[:-1])])
    x = np.concatenate([x for x, _ in parts])
    faces = np.concatenate([f + start for (_, f), start in zip(parts, starts, strict=True)])
    # Its top is far flatter than its feet, and a table is not held by its top.
    rule, words = likely_base(x, faces, ".stl")
    assert (rule[:3], words) == ("z <", "its feet are held")
    assert fixed_by_rule(rule, x).any()


def test_a_plate_that_lies_flat_is_held_at_one_end() -> None:
    """Held by its base, which is nearly half of its surface, it would give way nowhere."""
    x, faces = box((1.0, 0.5, 0.03))
    rule, words = likely_base(x, faces, ".stl")
    assert (rule[:3], words) == ("x <", "it lies flat, so one end of it is held")
    assert fixed_by_rule(rule, x).mean() < 0.3
