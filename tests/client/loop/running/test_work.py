"""How much a period does, counted and not timed, so that its cost does not creep back.

Plain Python stands for the compiled modules here: a call, an object or a byte is one in both.
"""

from __future__ import annotations

import gc
import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from types import FrameType

import pytest

from cohaptic_client.loop.memory import SAMPLE
from cohaptic_client.loop.running import haptic_loop
from tests.client.loop.running.rigs import Parent, Rig

FIRST, LAST = 60, 100  # periods that are counted: in contact, none with a patch or a look around


def counted(
    parent: Parent,
    monkeypatch: pytest.MonkeyPatch,
    start: Callable[[], None],
    end: Callable[[], None],
) -> None:
    """Run a loop that records nothing, with hooks before its first and after its last period."""
    monkeypatch.setattr(haptic_loop, "HOUSEKEEPING", 1e9)  # s: once, at the start
    parent.config = replace(parent.config, every_row=False)

    def each(reads: int) -> None:
        if reads == FIRST:
            start()
        elif reads == LAST:
            end()
            raise Over

    with pytest.raises(Over):
        parent.run(Rig(each))


class Over(Exception):
    """The periods are over."""


def test_a_period_calls_few_functions(parent: Parent, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = Counter[str]()

    def note(frame: FrameType, event: str, arg: object) -> None:
        if event == "call":
            calls[frame.f_code.co_qualname] += 1
        elif event == "c_call":
            calls[getattr(arg, "__qualname__", "?")] += 1

    counted(parent, monkeypatch, lambda: sys.setprofile(note), lambda: sys.setprofile(None))
    periods = LAST - FIRST
    each = {name: count / periods for name, count in calls.items()}
    # 155 now, 33 of them the built-in min and max, which are no calls once compiled.
    assert sum(each.values()) <= 157, calls.most_common(30)
    # The clock: before the sleep and after it, and, once it is warm, at the end of the period.
    assert each["SystemClock.now"] <= 3.0
    assert each["sleep"] <= 1.0
    # One value of each kind, but for the sights of both surfaces and of the way between them.
    made = {name.partition(".")[0]: n for name, n in each.items() if name.endswith(".__init__")}
    assert made.pop("Sight") <= 4.0
    assert made.pop("Gains", 0.0) <= 2.0
    assert max(made.values()) <= 1.0
    assert not {"Row", "_make", "dumps", "loads", "replace"} & {n.rpartition(".")[2] for n in each}


def test_a_period_keeps_no_memory(parent: Parent, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop runs without a collector of cycles, for hours."""
    sizes = list[int]()

    def look() -> None:
        sizes.append(tracemalloc.get_traced_memory()[0])

    gc.disable()
    tracemalloc.start()
    try:
        counted(parent, monkeypatch, look, look)
    finally:
        tracemalloc.stop()
        gc.enable()
    assert sizes[1] - sizes[0] < 4096  # of the rig's own log


def test_a_period_writes_its_sample_and_no_more(
    parent: Parent, monkeypatch: pytest.MonkeyPatch
) -> None:
    def image() -> bytes:
        with open(parent.memory.path, "rb") as file:
            return file.read()

    images = list[bytes]()

    def look() -> None:
        images.append(image())

    counted(parent, monkeypatch, look, look)
    changed = [at for at, (a, b) in enumerate(zip(*images, strict=True)) if a != b]
    assert 0 < len(changed)
    assert changed[-1] - changed[0] < 16 + SAMPLE.size  # a slot: its head and its value
