"""Files of the living stay, those of the dead go; other people's are not touched."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic.runtime.owned_files import own, remove_leftovers

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="has no such locks"),
]
CLOCK = SystemClock()
OWNER = """
import mmap, os, sys
from cohaptic.runtime.owned_files import own
with open(sys.argv[1], "r+b") as file:
    own(file.fileno())
    memory = mmap.mmap(file.fileno(), 4096)
print("owned", flush=True)
sys.stdin.read()
"""


def later(seconds: float = 120.0) -> float:
    """Unix time [s] by when what is made now is old."""
    return CLOCK.now() + CLOCK.to_wall() + seconds


def made(folder: Path, name: str) -> Path:
    path = folder / name
    path.write_bytes(bytes(4096))
    return path


def test_a_file_stays_as_long_as_a_process_has_it_mapped_and_goes_after_that_was_killed(
    tmp_path: Path,
) -> None:
    path, mesh = made(tmp_path, "ours-1.shm"), made(tmp_path, "ours-1.shm.mesh")
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert owner.stdout is not None
        assert owner.stdout.readline() == b"owned\n"
        assert remove_leftovers(tmp_path, "ours-", ".shm", later(), beside=".mesh") == 0
        assert path.exists()
    finally:
        owner.kill()
        owner.communicate()
    assert remove_leftovers(tmp_path, "ours-", ".shm", later(), beside=".mesh") == 1
    assert not path.exists()
    assert not mesh.exists()


def test_of_two_owners_one_is_enough(tmp_path: Path) -> None:
    path = made(tmp_path, "ours-1.shm")
    with path.open("r+b") as first, path.open("r+b") as second:
        own(first.fileno())
        own(second.fileno())
        first.close()
        assert remove_leftovers(tmp_path, "ours-", ".shm", later()) == 0
    assert remove_leftovers(tmp_path, "ours-", ".shm", later()) == 1


def test_another_users_file_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = made(tmp_path, "ours-1.shm")
    monkeypatch.setattr(os, "getuid", lambda: path.stat().st_uid + 1)
    assert remove_leftovers(tmp_path, "ours-", ".shm", later()) == 0


def test_one_that_cannot_be_removed_keeps_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(3):
        made(tmp_path, f"ours-{number}.shm")
        (tmp_path / f"ours-{number}.shm.files").mkdir()

    def removed(path: Path) -> None:
        if "ours-1" in path.name:
            raise PermissionError
        path.rmdir()

    monkeypatch.setattr("shutil.rmtree", removed)
    assert remove_leftovers(tmp_path, "ours-", ".shm", later(), beside=".files") == 2
    assert {path.name for path in tmp_path.iterdir()} == {"ours-1.shm", "ours-1.shm.files"}
