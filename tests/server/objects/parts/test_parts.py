from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.objects.parts.parts import MAX_NAME, distinct


@given(st.lists(st.text(max_size=80), max_size=20))
def test_names_of_any_file_become_distinct_and_can_be_written(names: list[str]) -> None:
    found = distinct(names)
    assert len(found) == len(names) == len(set(found))
    assert all(name.strip() and name.isprintable() for name in found)
    assert all(len(name) <= MAX_NAME + 4 for name in found)
