from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.tetrahedra import volumes
from cohaptic_server.objects.fill_process import FillLimitError, fill

pytestmark = pytest.mark.live

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")
OPTIONS = {"edge_length_fac": 0.1, "epsilon": 1e-3}
BALL = icosphere(3, 0.05)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_a_ball_is_filled_and_nothing_is_left_behind(folder: Path) -> None:
    fractions: list[float] = []
    x, tets = fill(*BALL, OPTIONS, progress=fractions.append)
    volume = float(np.abs(volumes(x, tets)).sum())
    assert volume == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=0.03)
    assert fractions == sorted(fractions)
    assert len(set(fractions)) > 3
    assert fractions[-1] == 1.0
    assert list(folder.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux keeps a process in its memory")
def test_it_cannot_take_more_memory_than_it_may() -> None:
    with pytest.raises(FillLimitError, match=r"filling it needs more than 0\.05 GB"):
        fill(*BALL, {**OPTIONS, "edge_length_fac": 0.015}, memory=5e7)


def test_it_is_stopped_at_its_time(folder: Path) -> None:
    with pytest.raises(FillLimitError, match=r"filling it takes more than 0\.5 s"):
        fill(*BALL, {**OPTIONS, "edge_length_fac": 0.005}, seconds=0.5)
    assert list(folder.iterdir()) == []


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[subprocess.Popen[str]]:
    """Processes that were started since."""
    made: list[subprocess.Popen[str]] = []
    popen = subprocess.Popen

    def recorded(*arguments: Any, **options: Any) -> subprocess.Popen[str]:
        made.append(popen(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(subprocess, "Popen", recorded)
    return made


def test_an_interruption_before_it_is_watched_ends_it_without_a_word(
    started: list[subprocess.Popen[str]], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C once a thread was started that reads what it says, and before that reads."""
    start, readers = threading.Thread.start, list[threading.Thread]()

    def interrupted(reader: threading.Thread) -> None:
        read = reader.run

        def late() -> None:
            out = started[0].stdout
            assert out is not None
            while not out.closed and started[0].poll() is None:
                os.sched_yield()
            read()

        monkeypatch.setattr(reader, "run", late)
        readers.append(reader)
        start(reader)
        raise KeyboardInterrupt

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        fill(*BALL, {**OPTIONS, "edge_length_fac": 0.01})
    for reader in readers:
        reader.join()  # what it raised would be a warning, and a warning is an error
    assert started[0].returncode is not None
    assert list(folder.iterdir()) == []


def test_an_interruption_ends_it_at_once(
    started: list[subprocess.Popen[str]], folder: Path
) -> None:
    def interrupt(fraction: float) -> None:
        if fraction > 0.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fill(*BALL, {**OPTIONS, "edge_length_fac": 0.01}, progress=interrupt)
    assert started[0].returncode is not None
    with pytest.raises(ProcessLookupError):
        os.kill(started[0].pid, 0)
    assert list(folder.iterdir()) == []


def test_what_fails_in_it_is_a_sentence_here() -> None:
    with pytest.raises(BodyError, match=r"could not fill the surface \(it ended with TypeError"):
        fill(*BALL, {**OPTIONS, "no_such_option": 1.0})
