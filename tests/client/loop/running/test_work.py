"""What a period leaves behind: its sample, and no memory.

Plain Python stands for the compiled modules here: an object or a byte is one in both.
"""

from __future__ import annotations

import gc
import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import pytest

from cohaptic.vec import Vec3
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

    rig = Rig(each)
    rig.log = Forgetful()
    with pytest.raises(Over):
        parent.run(rig)


class Forgetful(list[Vec3 | str]):
    """A log that keeps nothing: whether there was contact decides how much a log would keep."""

    def append(self, entry: Vec3 | str) -> None:
        pass


class Over(Exception):
    """The periods are over."""


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
    assert sizes[1] - sizes[0] < 1024  # one float kept in each is 960, with its list more


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
