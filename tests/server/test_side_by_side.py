from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic_server.side_by_side import both, cores, processors


def test_parts_that_ask_for_help_themselves_wait_for_nobody() -> None:
    def inner() -> tuple[int, int]:
        return both(lambda: 1, lambda: 2)

    assert [both(inner, inner) for _ in range(20)] == [((1, 2), (1, 2))] * 20


def test_an_error_is_raised_after_both_have_ended() -> None:
    ended = list[int]()

    def fails() -> None:
        ended.append(0)
        raise ValueError("here")

    with pytest.raises(ValueError, match="here"):
        both(lambda: ended.append(1), fails)
    assert sorted(ended) == [0, 1]
    with pytest.raises(ValueError, match="here"):
        both(fails, lambda: ended.append(2))
    assert both(lambda: 1, lambda: 2) == (1, 2)


def test_processors_are_those_of_the_container(tmp_path: Path) -> None:
    limit = tmp_path / "cpu.max"
    assert processors(limit) == cores()
    for text, count in (("max 100000", cores()), ("50000 100000", 0.5), ("rubbish", cores())):
        limit.write_text(text)
        assert processors(limit) == count
