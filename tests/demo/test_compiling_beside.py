"""Another process does the work here, in a folder that stands for a checkout."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import pytest

from cohaptic_tools.demo import demonstration
from cohaptic_tools.demo.demonstration import COMPILE, compiling_beside
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="on POSIX only"),
]


WORK = """
import sys
from pathlib import Path
print("compiling", flush=True)
sys.stdin.read()
Path("ended").touch()
"""


def checkout(folder: Path, work: str) -> Path:
    (folder / "compiling").mkdir()
    (folder / "compiling/__init__.py").touch()
    (folder / "compiling/beside.py").write_text(work)
    return folder


@pytest.fixture(autouse=True)
def nothing_is_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (COMPILE, "COHAPTIC_PLAIN"):
        monkeypatch.delenv(name, raising=False)


def test_it_is_told_in_one_line_and_ends_with_the_block(tmp_path: Path) -> None:
    told: list[str] = []
    heard = threading.Event()

    def tell(words: str) -> None:
        told.append(words)
        heard.set()

    with compiling_beside(tell, tmp_path / "log", checkout(tmp_path, WORK)):
        assert heard.wait(PATIENCE)
        assert not (tmp_path / "ended").exists()
    assert told == ["compiling"]
    assert (tmp_path / "ended").exists()


@pytest.mark.parametrize("work", ["", "raise SystemExit('no compiler')", "nonsense("])
def test_whatever_happens_to_it_the_block_goes_on(tmp_path: Path, work: str) -> None:
    told: list[str] = []
    with compiling_beside(told.append, tmp_path / "log", checkout(tmp_path, work)):
        pass
    assert told == []


@pytest.mark.parametrize(("name", "value"), [(COMPILE, "0"), ("COHAPTIC_PLAIN", "1")])
def test_it_can_be_switched_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)
    with compiling_beside(print, tmp_path / "log", checkout(tmp_path, WORK)):
        pass
    assert not (tmp_path / "log").exists()


def test_without_sources_there_is_nothing_to_compile(tmp_path: Path) -> None:
    with compiling_beside(print, tmp_path / "log", tmp_path):
        pass
    assert not (tmp_path / "log").exists()


def test_a_demonstration_of_this_checkout_looks_for_it_where_it_is() -> None:
    assert (demonstration.CHECKOUT / "compiling/beside.py").is_file()
