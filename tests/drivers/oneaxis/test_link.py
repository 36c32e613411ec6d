"""The driver on the real firmware, over a real pseudo-terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_drivers.oneaxis import handle, link
from cohaptic_drivers.oneaxis.frames import crc16
from tests.client.devices.until import until
from tests.client.plane import CONFIG

if sys.platform == "win32":
    pytest.skip("there are no pseudo-terminals", allow_module_level=True)

from tests.drivers.oneaxis.bench import CLOCK, UNIT, Bench

pytestmark = pytest.mark.live
LONG, SHORT = 20.0, 0.6  # s for a first answer: that comes, or that does not


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    # A machine that is busy with other tests; `test_handle.py` has a quarter of a second.
    monkeypatch.setattr(handle, "GIVE_UP", 2.0)
    monkeypatch.setattr(link, "FIRST_ANSWER", LONG)
    made = Bench(tmp_path / "mine.toml")
    yield made
    for device in made.devices:
        device.close()
    for board in made.boards:
        board.unplug()


def test_a_force_along_its_axis_is_a_current_and_the_handle_moves(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    assert device.info.max_force == 2.5  # of the board's 0.5 A, less than the unit's 3 N
    assert (device.info.sensed_axes, device.info.force_axes) == (1, 1)
    start = device.read(CLOCK.now()).position
    assert start == pytest.approx((0.0, -0.11, 0.0))  # before the body of 0.1 m
    until(lambda: bench.step(device) and board.current == -0.24)
    # Of 1.2 N its motor, which is stronger than the file says, makes 1.44: 3.6 mm of the hand.
    # What is beside the axis is not given.
    until(
        lambda: (
            bench.step(device)
            and abs(device.read(CLOCK.now()).position[1] + 0.1136) < 1e-4
            and board.current == -0.24
        )
    )
    device.close()
    until(lambda: board.current == 0.0)


@pytest.mark.parametrize(
    ("options", "start", "way"),
    [
        ("", (0.0, -0.11, 0.0), (0.0, 0.02, 0.0)),
        ("place=top", (0.0, 0.0, 0.11), (0.0, 0.0, -0.02)),
        ("turn=90", (0.0, -0.11, 0.0), (-0.02, 0.0, 0.0)),
        ("scale=2", (0.0, -0.11, 0.0), (0.0, 0.04, 0.0)),
    ],
)
def test_a_hand_that_presses_moves_the_tip_inward(
    bench: Bench, options: str, start: Vec3, way: Vec3
) -> None:
    board = bench.board()
    device = bench.open(board, options)
    assert device.read(CLOCK.now()).position == pytest.approx(start)
    board.rig.goal(0.02)
    speeds: list[float] = []

    def there() -> bool:
        sample = device.read(CLOCK.now())
        device.write(ZERO)
        speeds.append(norm(sample.velocity))
        return all(
            abs(a - b - c) < 1e-4 for a, b, c in zip(sample.position, start, way, strict=True)
        )

    until(there)
    # The lower limit is in `test_handle.py`: a process that waits may miss the whole way.
    assert max(speeds) < 1.5


def test_without_a_file_it_senses_only(bench: Bench) -> None:
    board = bench.board()
    choice = read_device(f"oneaxis:port={board.path}")
    device = open_device(replace(CONFIG.device, choice=choice))
    bench.devices.append(device)
    assert (device.info.max_force, device.info.force_axes) == (0.0, 0)
    for _ in range(100):
        bench.step(device)
    assert board.rig.limit == 0.0


def test_with_force_off_its_motor_stays_off(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board, "force=off")
    for _ in range(100):
        bench.step(device)
    assert board.rig.limit == 0.0


def test_a_file_that_asks_for_more_than_the_board_gives(bench: Bench) -> None:
    board = bench.board(limit=200)
    bench.unit.write_text(UNIT + "max_current = 10\nmax_force = 30\n")
    device = bench.open(board)
    assert device.info.max_force == 1.0
    until(lambda: bench.step(device, (0.0, -50.0, 0.0)) and board.current == -0.2)
    assert board.rig.limit == 0.2


def test_a_board_that_starts_swallows_the_first_calls_and_is_called_again(bench: Bench) -> None:
    bench.open(bench.board(swallow=12))


def test_unplugged_in_contact(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    board.unplug()
    reported = bench.end_of(device)
    assert "oneaxis: " in reported
    assert "unplugged" in reported or "silent" in reported


def test_a_host_that_is_gone_leaves_no_force(bench: Bench) -> None:
    """Nothing is written any more, as after `kill -9`: the firmware's own watchdog lets go."""
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    until(lambda: board.current == 0.0)
    off = len(board.given) - 1
    # And who begins again gets its force along the ramp.
    bench.press(device, board)
    given = board.given[off:]
    back = next(at for at, current in given if current < -0.2)
    assert back - max(at for at, current in given if current == 0.0 and at < back) > 0.3


def _report(counts: int, flags: int = 0) -> bytes:
    body = b"R\0" + bytes([flags]) + bytes(4) + counts.to_bytes(4, "little", signed=True) + bytes(2)
    return b"\xc5" + body + crc16(body).to_bytes(2, "little")


@pytest.mark.parametrize(
    ("garbage", "words"),
    [
        (b"\xff\xfe" * 30, "is none of its reports"),
        (b"\xc5R" * 30, "is none of its reports"),
        (_report(0)[:-1] + b"\0", "is none of its reports"),
        (_report(0), "its board started anew"),
        (_report(0, flags=1), "its sensor failed"),
        (b"\xc5", "has been silent"),
    ],
)
def test_garbage_in_contact(
    bench: Bench, garbage: bytes, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    monkeypatch.setattr(handle, "GIVE_UP", 0.25)  # later, single bytes were too many of them
    board.instead = garbage
    assert words in bench.end_of(device)
    board.instead = b""
    device.close()
    until(lambda: board.current == 0.0)


def test_a_sensor_that_fails_in_contact(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    board.rig.break_sensor()
    assert "its board says that its sensor failed" in bench.end_of(device)
    until(lambda: board.current == 0.0)


def test_a_board_that_stalls_is_not_fresh_and_then_gone(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    board.silent = True
    until(lambda: not device.read(CLOCK.now()).fresh)
    until(lambda: bench.step(device) and board.current == 0.0)  # by its own watchdog
    assert "its board has been silent" in bench.end_of(device)


def test_two_boards_at_once(bench: Bench) -> None:
    left, right = bench.board(), bench.board()
    one, two = bench.open(left), bench.open(right)
    bench.press(one, left)
    assert right.rig.limit == 0.0
    left.unplug()
    bench.end_of(one)
    bench.press(two, right)


def test_something_else_at_the_port(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link, "FIRST_ANSWER", SHORT)
    board = bench.board()
    for instead in (b"[3,0,0,0,0,0,0,0]\n", b"\x2b" + bytes(range(24)), b"ok\n" * 80):
        board.instead = instead
        assert "does not answer as such a board does" in bench.complaint(board)
    board.instead = b""
    monkeypatch.setattr(link, "FIRST_ANSWER", LONG)
    bench.open(board)


def _description(version: int, watchdog: int) -> bytes:
    figures = b"".join(each.to_bytes(2, "little") for each in (500, 1000, watchdog, 500, 2000))
    body = b"D\0cohaptic" + bytes([version]) + figures
    return b"\xc5" + body + crc16(body).to_bytes(2, "little")


@pytest.mark.parametrize(
    ("version", "watchdog", "words"),
    [
        (2, 50, "speaks version 2, this program 1; load the one of examples/one_axis_board"),
        (1, 1000, "holds a force for 1000 ms of silence"),
        (1, 0, "holds a force for 0 ms of silence"),
    ],
)
def test_firmware_that_is_not_known_or_holds_on_is_refused(
    bench: Bench, version: int, watchdog: int, words: str
) -> None:
    board = bench.board()
    board.instead = _description(version, watchdog)
    assert words in bench.complaint(board)
