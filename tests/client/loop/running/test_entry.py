"""The life of the loop's process, in the tests' own."""

from __future__ import annotations

import gc
import signal
from collections.abc import Callable, Iterator

import pytest

from cohaptic.errors import CohapticError, DeviceError
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.devices.device import Device
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.loop.memory import LoopMemory, Slot
from cohaptic_client.loop.running import entry
from tests.client.loop.running.rigs import FORCE, Parent, Rig

Main = Callable[[Device | CohapticError], None]


@pytest.fixture
def main(parent: Parent, monkeypatch: pytest.MonkeyPatch) -> Iterator[Main]:
    """The entry point of the process, here, without its lasting changes to the process."""

    def run(device: Device | CohapticError) -> None:
        def opened(config: DeviceConfig) -> Device:
            assert config == parent.config.device
            if isinstance(device, CohapticError):
                raise device
            return device

        monkeypatch.setattr(entry, "open_device", opened)

        def as_it_was(_priority: int) -> str:
            return "as it was"

        monkeypatch.setattr(entry, "prefer_this_process", as_it_was)
        entry.live(parent.config.to_json())

    ctrl_c = signal.getsignal(signal.SIGINT)
    yield run
    signal.signal(signal.SIGINT, ctrl_c)
    gc.unfreeze()
    gc.enable()


def fail_after(reads: int, error: Exception) -> Callable[[int], None]:
    def each(count: int) -> None:
        if count == reads:
            raise error

    return each


class Watched(Rig):
    """A rig that notes at each write whether trouble was reported already."""

    def __init__(self, each: Callable[[int], None], status: Slot) -> None:
        super().__init__(each)
        self.status = status
        self.reported = list[bool]()

    def write(self, force: Vec3) -> None:
        super().write(force)
        self.reported.append(b'"error"' in (self.status.read() or b""))


class Broken(Rig):
    """A device whose driver raises at every write once it broke."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error = error

    def write(self, force: Vec3) -> None:
        super().write(force)
        if self.reads >= 50:
            raise self.error


def after_the_last_read(rig: Rig) -> list[Vec3 | str]:
    return rig.log[len(rig.log) - rig.log[::-1].index("read") :]


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (DeviceError("rig", "it was unplugged", "plug it in again"), "rig: it was unplugged; plug"),
        (ValueError("boom"), "the haptic loop failed: ValueError('boom')"),
    ],
    ids=["foreseen", "unforeseen"],
)
def test_trouble_in_the_device_means_zero_force_twice_then_close_then_the_report(
    parent: Parent, main: Main, error: Exception, words: str
) -> None:
    watching = LoopMemory(parent.memory.path)
    rig = Watched(fail_after(100, error), watching.status)
    with pytest.raises((SystemExit, ValueError)):
        main(rig)
    assert norm(rig.forces[98]) == pytest.approx(FORCE)  # in the period before the trouble
    assert after_the_last_read(rig)[:3] == [ZERO, ZERO, "close"]
    assert not any(rig.reported[: 99 + 2])
    assert str(parent.status()["error"]).startswith(words)
    watching.close(remove=False)


@pytest.mark.parametrize(
    "error", [DeviceError("rig", "gone"), OSError("gone"), RuntimeError("gone")]
)
def test_a_device_that_refuses_every_write_is_told_zero_twice_closed_and_reported(
    parent: Parent, main: Main, error: Exception
) -> None:
    rig = Broken(error)
    with pytest.raises((SystemExit, type(error))):
        main(rig)
    assert after_the_last_read(rig)[1:4] == [ZERO, ZERO, "close"]
    assert "gone" in str(parent.status()["error"])


def test_a_device_that_cannot_be_had_ends_the_process_with_its_sentence(
    parent: Parent, main: Main
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(DeviceError("spacemouse", "no SpaceMouse was found", "plug one in"))
    assert ended.value.code == 2
    assert parent.status() == {"error": "spacemouse: no SpaceMouse was found; plug one in"}


def test_told_to_stop_the_process_ends_without_a_word_and_lets_go(
    parent: Parent, main: Main
) -> None:
    rig = Rig(parent.stop_after(50))
    main(rig)
    assert rig.log[-3:] == [ZERO, ZERO, "close"]
    assert "error" not in parent.status()


def test_ctrl_c_does_not_reach_the_loop(parent: Parent, main: Main) -> None:
    reached = list[int]()
    signal.signal(signal.SIGINT, lambda number, _: reached.append(number))

    def each(reads: int) -> None:
        if reads == 20:
            signal.raise_signal(signal.SIGINT)
        if reads == 50:
            parent.command(stop=True)

    rig = Rig(each)
    main(rig)
    assert rig.reads > 50
    assert reached == []
