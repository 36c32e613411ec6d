"""The loop's configuration from settings and welcome, and which welcomes a loop takes."""

from __future__ import annotations

import asyncio
import errno
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, NoReturn

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError
from cohaptic.protocol.messages import BodyInfo, Welcome
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.haptics import Haptics, loop_config
from cohaptic_client.loop.config import LoopConfig, silent_after
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.settings import ClientSettings

pytestmark = pytest.mark.alone

BODY = BodyInfo(name="plane", center=(0.1, 0.2, 0.3), radius=0.1, contact_radius=0.02)
SETTINGS = ClientSettings(url="ws://127.0.0.1:1", name="left")


def welcome(simulation_period: float = 1.0 / 60.0) -> Welcome:
    return Welcome(
        user=1,
        name="left",
        simulation_period=simulation_period,
        to_wall=0.0,
        body=BODY,
        users=(),
    )


def config(settings: ClientSettings, simulation_period: float = 1.0 / 60.0) -> LoopConfig:
    return loop_config(
        settings,
        welcome(simulation_period),
        memory="here",
        clock_origin=5.0,
        rest_mesh=None,
        mesh=None,
        every_row=False,
    )


@given(
    st.floats(500.0, 4000.0),
    st.floats(0.005, 0.1),
    st.floats(0.1, 20.0),
    st.booleans(),
    st.sampled_from(["simulated", "spacemouse"]),
)
def test_the_loop_gets_the_settings_the_body_and_the_limits_of_the_device(
    loop_hz: float, simulation_period: float, max_force: float, passivity: bool, name: str
) -> None:
    settings = replace(
        SETTINGS,
        loop_hz=loop_hz,
        max_force=max_force,
        passivity=passivity,
        device=DeviceChoice(name),
    )
    made = config(settings, simulation_period)
    device = device_info(DeviceChoice(name))
    assert (made.memory, made.clock_origin, made.rest_mesh) == ("here", 5.0, None)
    assert made.haptic_period == made.limits.period == pytest.approx(1.0 / loop_hz)
    assert made.simulation_period == simulation_period
    assert made.limits.silent_after == silent_after(simulation_period)
    assert made.limits.max_force == made.law.max_force <= max_force
    if device.max_force > 0.0:
        assert made.limits.max_force <= device.max_force
    assert made.limits.stall == device.stall
    assert (made.max_damping > 0.0) <= passivity
    assert (made.device.choice.name, made.device.center, made.device.radius) == (
        name,
        BODY.center,
        BODY.radius,
    )


def test_a_full_disk_before_there_is_a_loop_is_one_sentence(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    full = OSError(errno.ENOSPC, "No space left on device")
    words = r"^simulated: there is no room for its loop's memory \(No space left on device\); make"
    haptics = Haptics(SETTINGS, SystemClock(), None)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", raises(full))
        with pytest.raises(DeviceError, match=words):
            haptics.keep_mesh(RestMesh(((0.0, 0.0, 0.0),) * 3, ((0, 1, 2),)))
    haptics.close()
    monkeypatch.setattr(LoopMemory, "create", raises(full))
    with pytest.raises(DeviceError, match=words):
        Haptics(SETTINGS, SystemClock(), None)


def raises(error: Exception) -> Callable[..., NoReturn]:
    def call(*_: object) -> NoReturn:
        raise error

    return call


class Process:
    """Stands for the loop's process: it has a fault, and notes how it was begun."""

    def __init__(self, config: LoopConfig, _memory: LoopMemory) -> None:
        self.config = config
        self.status: dict[str, object] = {}
        self.begun.append(config)

    begun: ClassVar[list[LoopConfig]] = []
    last: ClassVar[dict[str, object]] = {}

    def request_stop(self) -> None:
        pass

    def wait(self) -> None:
        pass

    def beat(self) -> None:
        self.status = self.last

    def read_status(self) -> None:  # the last report comes with the end
        self.status = self.last

    def new_rows(self) -> bytes:
        return b""


@pytest.mark.parametrize(("mode", "kept"), [("fault", "why"), ("waiting", "")])
def test_a_fault_that_nobody_has_acknowledged_goes_on_to_the_next_object(
    monkeypatch: pytest.MonkeyPatch, mode: str, kept: str
) -> None:
    monkeypatch.setattr("cohaptic_client.haptics.HapticProcess", Process)
    monkeypatch.setattr(Process, "begun", [])
    monkeypatch.setattr(Process, "last", {"mode": mode, "fault": "why"})

    async def moved() -> None:
        haptics = Haptics(SETTINGS, SystemClock(), None)
        haptics.start(welcome())
        for _ in range(2):  # from object to object
            haptics = await haptics.anew()
            haptics.start(welcome())
        haptics.close()

    asyncio.run(moved())
    assert [config.fault for config in Process.begun] == ["", kept, kept]


def test_a_fault_that_was_over_before_a_heartbeat_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rule that raised once took the force away for 23 ms, and nobody was told."""
    monkeypatch.setattr("cohaptic_client.haptics.HapticProcess", Process)
    haptics, reported = Haptics(SETTINGS, SystemClock(), None), list[str]()
    haptics.start(welcome())
    for fault, faults, last in (("", 0, ""), ("", 1, "why"), ("", 1, "why"), ("now", 2, "now")):
        status = {"mode": "waiting", "fault": fault, "faults": faults, "last_fault": last}
        monkeypatch.setattr(Process, "last", status)
        reported.append(haptics.beat())
    haptics.close()
    assert reported == ["", "why", "", "now"]
