"""Text that nobody reads, over real pipes and a real terminal."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from cohaptic.runtime.aside import Aside
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="pipes of another kind"),
]

LINE = "x" * 99 + "\n"


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """The two ends of one."""
    ends = os.pipe()
    yield ends
    for end in ends:
        try:
            os.close(end)
        except OSError:
            continue


def read_until(file: int, end: bytes) -> bytes:
    found = b""
    while not found.endswith(end):
        found += os.read(file, 65536)
    return found


def test_what_is_read_comes_whole_and_in_order(pipe: tuple[int, int]) -> None:
    reads, writes = pipe
    out, found = Aside(writes), list[bytes]()
    reader = threading.Thread(target=lambda: found.append(read_until(reads, b"end\n")))
    reader.start()
    for i in range(2000):
        out.write(f"{i}\n")
    out.write("end\n")
    assert out.drain(PATIENCE)
    reader.join()
    assert found[0].decode().split() == [*map(str, range(2000)), "end"]
    assert out.left_out == 0


def test_nobody_waits_for_a_pipe_that_nobody_reads_and_what_is_left_out_is_counted(
    pipe: tuple[int, int],
) -> None:
    reads, writes = pipe
    out = Aside(writes, limit=1000)
    sent = 0
    while out.drain(0.05):  # until the pipe is full
        for _ in range(9):
            out.write(LINE)
        sent += 9
    for _ in range(1000):
        out.write(LINE)
    sent, lost = sent + 1000, out.left_out
    assert lost > 980
    found = [os.read(reads, 65536)]
    while not out.drain(0.05):
        found.append(os.read(reads, 65536))
    out.write("after\n")
    found.append(read_until(reads, b"after\n"))
    lines = b"".join(found).decode().splitlines()
    assert lines[-2:] == [f"{lost} lines were left out here: nobody read them in time", "after"]
    # All others came whole.
    assert lines[:-2] == [LINE.strip()] * (sent - lost)
    assert out.left_out == lost


def test_a_terminal_that_is_stopped_holds_nobody_up() -> None:
    import pty

    screen, terminal = pty.openpty()
    out = Aside(terminal, limit=1000)
    assert out.isatty()
    out.write("before\n")
    assert out.drain(PATIENCE)
    read_until(screen, b"before\r\n")
    os.write(screen, b"\x13")  # Ctrl-S
    while out.drain(0.05):  # the system sees to it in its own time
        out.write(LINE)
    for _ in range(100):
        out.write(LINE)
    assert out.left_out > 0
    os.write(screen, b"\x11")  # Ctrl-Q
    while not out.drain(0.05):
        os.read(screen, 65536)
    os.close(screen)
    os.close(terminal)


def test_where_the_reader_is_gone_for_good_nothing_waits_and_all_is_counted(
    pipe: tuple[int, int],
) -> None:
    reads, writes = pipe
    os.close(reads)
    out = Aside(writes)
    out.write(LINE)
    assert out.drain(PATIENCE)
    for _ in range(10):
        out.write(LINE)
    assert (out.drain(0.0), out.left_out) == (True, 11)


def test_a_disk_that_is_full_for_a_moment_costs_what_was_said_in_it_alone(tmp_path: Path) -> None:
    file, log = os.open("/dev/full", os.O_WRONLY), tmp_path / "log"
    out = Aside(file)
    out.write("one\ntwo\n")
    assert out.drain(PATIENCE)
    assert out.left_out == 2
    with log.open("wb") as room:
        os.dup2(room.fileno(), file)
    out.write("three\n")
    assert out.drain(PATIENCE)
    os.close(file)
    reported, said = log.read_text().splitlines()
    assert reported.startswith("2 lines")
    assert said == "three"
