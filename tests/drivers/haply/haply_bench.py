"""An emulated service and the driver on it, for the tests of the driver."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cohaptic.errors import DeviceError
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_client.devices.device import Device
from cohaptic_drivers.haply import exchange, inverse3, service
from cohaptic_drivers.haply.inverse3 import MIDDLE
from tests.client.devices.until import SteadyClock, until
from tests.client.plane import CONFIG
from tests.drivers.haply.emulator import EmulatedArm, HaplyEmulator

CLOCK = SteadyClock()
PUSH: Vec3 = (0.5, -1.0, 2.0)


def be_patient(patch: pytest.MonkeyPatch) -> None:
    """Let the driver wait for a service on a machine that is busy with other tests.

    Its two threads notice a silence in the order that they have on an idle one. A state that is old
    since this machine was busy is no stall: it would take the force away for half a second, again
    and again.
    """
    patch.setattr(inverse3, "SILENCE", 20.0)
    patch.setattr(exchange, "GIVE_UP", 2.0)
    patch.setattr(inverse3, "GIVE_UP", 20.0)
    patch.setattr(inverse3, "_FIRST_ANSWER", 20.0)
    patch.setattr(service, "_HANDSHAKE", 20.0)
    patch.setattr(exchange, "LONGEST_CLOSE", 20.0)


class Bench:
    """An emulator, and devices on it."""

    def __init__(self) -> None:
        self._patch = pytest.MonkeyPatch()
        be_patient(self._patch)
        self.emulator = HaplyEmulator([EmulatedArm()])
        self.devices: list[Device] = []

    @property
    def arm(self) -> EmulatedArm:
        return self.emulator.arms["049D"]

    def open(self, options: str = "") -> Device:
        text = f"haply:url={self.emulator.url}" + (f",{options}" if options else "")
        device = open_device(replace(CONFIG.device, choice=read_device(text), center=MIDDLE))
        self.devices.append(device)
        return device

    def complaint(self, options: str = "") -> str:
        with pytest.raises(DeviceError) as caught:
            self.open(options)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    def press(self, device: Device, force: Vec3 = PUSH) -> None:
        """Write until the service has the force."""

        def given() -> bool:
            device.read(CLOCK.now())
            device.write(force)
            return self.arm.force == force

        until(given)

    def end_of(self, device: Device) -> str:
        """The error with which a device that is read and written ends."""

        def ended() -> bool:
            try:
                device.read(CLOCK.now())
                device.write(PUSH)
            except DeviceError as error:
                reported.append(str(error))
            return bool(reported)

        reported: list[str] = []
        until(ended)
        assert "\n" not in reported[0]
        with pytest.raises(DeviceError):
            device.write(PUSH)
        return reported[0]

    def close(self) -> None:
        for device in self.devices:
            device.close()
        self.emulator.close()
        self._patch.undo()
