"""Lines of a terminal, of a program and of nobody."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from cohaptic_client import touching
from cohaptic_client.touching import EnterKey
from tests.patience import PATIENCE

if sys.platform == "win32":
    pytest.skip("there are no pseudo-terminals", allow_module_level=True)

pytestmark = pytest.mark.live


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, int]]:
    """A pseudo-terminal that is standard input: the user's end and the process's."""
    user, process = os.openpty()
    monkeypatch.setattr(touching, "AGAIN", 0.001)
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(fileno=lambda: process))
    yield user, process
    for end in (user, process):
        try:
            os.close(end)
        except OSError:
            pass  # a test has closed it


async def eventually(heard: asyncio.Event) -> None:
    await asyncio.wait_for(heard.wait(), PATIENCE)


async def over(key: EnterKey) -> None:
    while key.listening():
        await asyncio.sleep(0.001)


def test_each_line_is_heard_until_it_is_stopped(ends: tuple[int, int]) -> None:
    async def listen() -> None:
        heard = asyncio.Event()
        key = EnterKey(heard.set)
        for _ in range(2):
            os.write(ends[0], b"\n")
            await eventually(heard)
            heard.clear()
        assert key.listening()
        key.stop()
        os.write(ends[0], b"\n")
        await asyncio.wait_for(over(key), PATIENCE)
        assert not heard.is_set()

    asyncio.run(listen())


def test_where_nobody_is_there_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    async def listen() -> None:
        monkeypatch.setattr(sys, "stdin", None)
        assert not EnterKey(lambda: None).listening()
        with open(os.devnull) as nothing:
            monkeypatch.setattr(sys, "stdin", nothing)
            await asyncio.wait_for(over(EnterKey(lambda: None)), PATIENCE)
        user, process = os.openpty()
        monkeypatch.setattr(sys, "stdin", SimpleNamespace(fileno=lambda: process))
        key = EnterKey(lambda: None)
        assert key.listening()
        os.close(user)  # the terminal is closed
        await asyncio.wait_for(over(key), PATIENCE)
        os.close(process)

    asyncio.run(listen())
