from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from pathlib import Path

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.credentials.reloading import Watched, reload_changed

pytestmark = pytest.mark.live


async def changes(path: Path, change: str, times: list[str]) -> None:
    """What is read after a change, or after a signal where nothing has changed."""
    read = asyncio.Event()
    loop = asyncio.get_running_loop()

    def load() -> None:
        text = path.read_text()
        times.append(text)
        loop.call_soon_threadsafe(read.set)
        if text == "bad":
            raise SettingError("it", "bad", "good")

    every = 60.0 if change == "signal" else 0.01
    task = asyncio.ensure_future(reload_changed([Watched("it", [path], load)], every))
    await asyncio.sleep(0)
    if change == "signal":
        os.kill(os.getpid(), signal.SIGHUP)
        await asyncio.wait_for(read.wait(), 30.0)
    else:
        for text in ("longer", "bad", "longest of all"):
            read.clear()
            path.write_text(text)
            while times[-1:] != [text]:
                await asyncio.wait_for(read.wait(), 30.0)
                read.clear()
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


def test_a_file_that_changes_is_read_again_also_after_one_that_was_wrong(tmp_path: Path) -> None:
    path, times = tmp_path / "file", list[str]()
    path.write_text("first")
    asyncio.run(changes(path, "files", times))
    assert {"longer", "bad", "longest of all"} <= set(times)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGHUP")
def test_a_signal_reads_it_again_though_it_has_not_changed(tmp_path: Path) -> None:
    path, times = tmp_path / "file", list[str]()
    path.write_text("first")
    asyncio.run(changes(path, "signal", times))
    assert times == ["first"]
