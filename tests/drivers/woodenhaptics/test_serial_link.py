"""The driver on the serial board's firmware, over a real pseudo-terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace

import pytest

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_client.devices.device import Device
from cohaptic_drivers.woodenhaptics import arm, serial_link
from tests.client.devices.until import SteadyClock, until
from tests.client.plane import CONFIG

if sys.platform == "win32":
    pytest.skip("there are no pseudo-terminals", allow_module_level=True)

from tests.drivers.woodenhaptics.serial_board import SerialBoard

pytestmark = pytest.mark.live

CLOCK = SteadyClock()
PUSH: Vec3 = (0.5, -1.0, 2.0)


class Bench:
    def __init__(self) -> None:
        self.boards: list[SerialBoard] = []
        self.devices: list[Device] = []

    def board(self, model: int = 3, swallow: int = 0) -> SerialBoard:
        self.boards.append(SerialBoard(model, swallow=swallow))
        return self.boards[-1]

    def open(self, board: SerialBoard, options: str = "") -> Device:
        text = f"woodenhaptics:port={board.path},place=center" + (f",{options}" if options else "")
        self.devices.append(open_device(replace(CONFIG.device, choice=read_device(text))))
        return self.devices[-1]

    def complaint(self, board: SerialBoard, options: str = "") -> str:
        with pytest.raises(DeviceError) as caught:
            self.open(board, options)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    def step(self, device: Device) -> bool:
        device.read(CLOCK.now())
        device.write(PUSH)
        return True

    def press(self, device: Device, board: SerialBoard) -> None:
        until(lambda: self.step(device) and norm(board.currents) > 100.0)

    def end_of(self, device: Device) -> str:
        def ended() -> bool:
            try:
                self.step(device)
            except DeviceError as error:
                reported.append(str(error))
            return bool(reported)

        reported: list[str] = []
        until(ended)
        assert "\n" not in reported[0]
        return reported[0]


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    # A machine that is busy with other tests; `test_arm.py` has that it is a quarter of a second.
    monkeypatch.setattr(arm, "GIVE_UP", 2.0)
    made = Bench()
    yield made
    for device in made.devices:
        device.close()
    for board in made.boards:
        board.unplug()


def test_counts_are_a_place_and_a_force_is_currents(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    assert device.read(CLOCK.now()).position == pytest.approx((0.0, -0.025, 0.205))
    device.write((2.0, -1.0, 3.0))  # (1, 2, 3) N in the frame of the published vectors
    until(lambda: board.currents == (1182.0, -660.0, -2365.0))
    assert board.errors == []
    device.close()
    until(lambda: board.currents == ZERO)


def test_a_moving_arm_is_followed_with_its_velocity(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    start = device.read(CLOCK.now()).position
    seen: list[Vec3] = []

    def moved() -> bool:
        board.counts = (board.counts[0] + 2.0, 0.0, 0.0)
        sample = device.read(CLOCK.now())
        device.write(ZERO)
        seen.append(sample.velocity)
        return sample.position[0] > start[0] + 0.01

    until(moved)
    assert max(v[0] for v in seen) > 0.0
    assert all(abs(v[2]) < 1e-9 for v in seen)  # it turns about the vertical


def test_a_force_that_motors_cannot_give_is_less_and_never_none(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    device.read(CLOCK.now())
    device.write((200.0, -100.0, 300.0))
    until(lambda: max(map(abs, board.currents)) > 2900.0)
    assert max(map(abs, board.currents)) <= 3000.0
    assert board.currents[0] == pytest.approx(1182.4 / 2364.9 * 3000.0, abs=1.0)


def test_unplugged_in_contact(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    board.unplug()
    bench.boards.clear()
    reported = bench.end_of(device)
    assert "woodenhaptics: " in reported
    assert "unplugged" in reported or "silent" in reported


@pytest.mark.parametrize(
    ("garbage", "words"),
    [
        (b"[3,9,9]\n", "is no answer of it"),
        (b"\xff\xfe" * 30 + b"\n", "is no answer of it"),
        (b"[3,1,1,1,0,0,0,1024]\n", "tells error 1024"),
        (b"x" * 3000, "has no lines"),
        (b"[3,90000,0,0,0,0,0,0]\n", "its encoders jumped"),
    ],
)
def test_garbage_in_contact(bench: Bench, garbage: bytes, words: str) -> None:
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    board.instead = garbage
    assert words in bench.end_of(device)
    board.instead = b""
    device.close()
    until(lambda: board.currents == ZERO)


def test_a_board_that_stalls_is_not_fresh_and_then_gone(bench: Bench) -> None:
    board = bench.board()
    device = bench.open(board)
    bench.press(device, board)
    board.silent = True
    until(lambda: not device.read(CLOCK.now()).fresh)
    # A hand that is not seen is let go.
    until(lambda: bench.step(device) and board.currents == ZERO)
    assert "its board has been silent" in bench.end_of(device)


def test_a_loop_that_ends_without_closing_is_the_boards_own_watchdogs_business(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The firmware switches off after 100 ms without a command; nothing but the loop sends one."""
    # Called once, however late its answer is: that to a second call would come afterwards.
    monkeypatch.setattr(serial_link, "_CALLS", 20.0)
    monkeypatch.setattr(serial_link, "_FIRST_ANSWER", 20.0)
    board = SerialBoard()
    text = f"woodenhaptics:port={board.path}"
    device = open_device(replace(CONFIG.device, choice=read_device(text)))
    device.read(CLOCK.now())
    answers = board.answers
    end = CLOCK.now() + 0.05
    until(lambda: CLOCK.now() > end)
    assert board.answers == answers
    device.close()
    board.unplug()


def test_counters_that_are_no_pose_are_told_with_what_to_do(bench: Bench) -> None:
    board = bench.board(model=1)
    board.counts = (0.0, 0.0, -10000.0)  # where the closed chain does not close
    reported = bench.complaint(board, "kind=polhem")
    assert "a pose that it cannot have; hold it in its home pose" in reported


def test_a_haply_at_the_address_is_refused(bench: Bench) -> None:
    board = bench.board()
    board.instead = b"\x2b" + bytes(range(24)) + b"\xba\0\0\0\0"  # frames of its own protocol
    reported = bench.complaint(board)
    assert "does not answer as its board does" in reported
    assert "--device haply" in reported


def test_two_boards_at_once(bench: Bench) -> None:
    left, right = bench.board(), bench.board()
    right.counts = (1000.0, 0.0, 0.0)
    one, two = bench.open(left), bench.open(right)
    assert one.read(CLOCK.now()).position != two.read(CLOCK.now()).position
    bench.press(one, left)
    assert right.currents == ZERO
    bench.boards.remove(left)
    left.unplug()
    bench.end_of(one)
    bench.press(two, right)
