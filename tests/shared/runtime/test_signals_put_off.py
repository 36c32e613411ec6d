from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from cohaptic.runtime.signals_put_off import (
    _NAMES,  # pyright: ignore[reportPrivateUsage]
    signals_put_off,
)

NUMBERS = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]


@pytest.fixture(params=NUMBERS, ids=lambda number: signal.Signals(number).name)
def number(request: pytest.FixtureRequest) -> Iterator[int]:
    before = signal.getsignal(request.param)
    yield request.param
    signal.signal(request.param, before)


def test_a_signal_does_after_the_block_what_it_would_have_done_within(number: int) -> None:
    said: list[str] = []

    def handle(_number: int, _frame: object) -> None:
        said.append("handled")

    signal.signal(number, handle)
    with signals_put_off() as ended:
        assert not ended()
        signal.raise_signal(number)
        signal.raise_signal(number)
        assert ended()
        said.append("let go")
    assert said == ["let go", "handled"]
    signal.raise_signal(number)
    assert said[-2:] == ["handled", "handled"]


def test_what_was_ignored_is_ignored_afterwards(number: int) -> None:
    signal.signal(number, signal.SIG_IGN)
    with signals_put_off():
        signal.raise_signal(number)
    assert signal.getsignal(number) == signal.SIG_IGN
