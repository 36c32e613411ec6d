from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.objects.auto.diagnose import likely_scale
from cohaptic_server.objects.surface.accept import MAX_SIZE, MIN_SIZE


@given(size=st.floats(1e-8, 1e8))
def test_whatever_the_file_says_the_object_can_be_touched(size: float) -> None:
    found = likely_scale(size)
    scale = 1.0 if found is None else found[0]
    assert MIN_SIZE <= scale * size <= MAX_SIZE
    if found is not None:
        assert found[1].option == f"--scale {scale:g}"
        assert float(f"{scale:g}") == scale  # what is written is what is meant
