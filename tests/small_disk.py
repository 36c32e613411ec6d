"""A disk that a test can fill: a small tmpfs of its own."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path

from tests.give_up import give_up


@contextlib.contextmanager
def small_disk(folder: Path, size: str) -> Generator[Path]:
    """So large, in the words of `mount`, at a folder that is made."""
    folder.mkdir()
    if sys.platform != "linux":
        give_up("a tmpfs needs Linux")
    options = ["-t", "tmpfs", "-o", f"size={size},mode=700", "cohaptic-test", str(folder)]
    mounted = subprocess.run(["mount", *options], capture_output=True, text=True, check=False)
    if mounted.returncode:
        give_up(f"no tmpfs can be mounted here: {mounted.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def forbid_writing(disk: Path) -> None:
    """Make a small disk read-only; the mode of a folder would not keep an administrator out."""
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)


def fill(disk: Path) -> Path:
    """Until not a byte is left; returns the file that fills it."""
    path = disk / "filling"
    with path.open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(4096))
    assert os.statvfs(disk).f_bavail == 0
    return path
