from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.objects.auto.diagnose import likely_scale
from cohaptic_server.objects.surface.accept import MAX_SIZE, MIN_SIZE


@pytest.mark.parametrize("size", [0.005, 0.1, 1.0])
def test_what_fits_a_hand_in_metres_is_in_metres(size: float) -> None:
    assert likely_scale(size) is None


@pytest.mark.parametrize(
    ("size", "scale", "unit"), [(170.0, 1e-3, "millimetres"), (12.0, 1e-2, "centimetres")]
)
def test_a_large_number_is_of_a_small_unit(size: float, scale: float, unit: str) -> None:
    found = likely_scale(size)
    assert found is not None
    assert found[0] == scale
    assert unit in found[1].remedy


def test_two_metres_are_possible_but_a_hand_does_not_reach_round_them() -> None:
    found = likely_scale(2.0)
    assert found is not None
    assert found[1].needed is False
    assert found[0] == pytest.approx(0.1)


@given(size=st.floats(1e-8, 1e8))
def test_whatever_the_file_says_the_object_can_be_touched(size: float) -> None:
    found = likely_scale(size)
    scale = 1.0 if found is None else found[0]
    assert MIN_SIZE <= scale * size <= MAX_SIZE
    if found is not None:
        assert found[1].option == f"--scale {scale:g}"
        assert float(f"{scale:g}") == scale  # what is written is what is meant
