"""The makers' libraries, made of their published interfaces by the C compiler."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_client.devices.device import Device
from tests.client.devices.until import until
from tests.client.plane import CONFIG

CLOCK = SystemClock()
SOURCE = Path(__file__).with_name("vendor_libraries.c")
PUSH: Vec3 = (1.0, 2.0, 3.0)


class Bench:
    """A library, and devices of a driver on it."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        self.library = ctypes.CDLL(str(path))
        self.devices: list[Device] = []

    def set(self, name: str, value: int) -> None:
        ctypes.c_int.in_dll(self.library, f"fake_{name}").value = value

    def get(self, name: str) -> int:
        return ctypes.c_int.in_dll(self.library, f"fake_{name}").value

    def watchdog(self) -> int:
        """Of the device's firmware, in 125 us."""
        return ctypes.c_ubyte.in_dll(self.library, "fake_watchdog").value

    def opened_name(self) -> str:
        """Of the device that OpenHaptics was asked for."""
        name: Any = (ctypes.c_char * 32).in_dll(self.library, "fake_name")
        return bytes(name).split(b"\0")[0].decode()

    def put(self, name: str, values: Vec3) -> None:
        vector: Any = (ctypes.c_double * 3).in_dll(self.library, f"fake_{name}")
        vector[:] = values

    def force(self, device: int = 0) -> Vec3:
        array: Any = (ctypes.c_double * 6).in_dll(self.library, "fake_force")
        x, y, z = array[3 * device : 3 * device + 3]
        return (x, y, z)

    def open(self, options: str = "") -> Device:
        text = f"{self.name}:library={self.path},place=center" + (f",{options}" if options else "")
        self.devices.append(open_device(replace(CONFIG.device, choice=read_device(text))))
        return self.devices[-1]

    def complaint(self, options: str = "") -> str:
        with pytest.raises(DeviceError) as caught:
            self.open(options)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    def end_of(self, device: Device) -> str:
        def ended() -> bool:
            try:
                device.read(CLOCK.now())
                device.write(PUSH)
            except DeviceError as error:
                reported.append(str(error))
            return bool(reported)

        reported: list[str] = []
        until(ended)
        return reported[0]


def make_bench(name: str, folder: Path) -> Iterator[Bench]:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    path = folder / "vendor.so"
    command = [compiler, "-shared", "-fPIC", "-Wall", "-Werror", "-pthread", "-o", str(path)]
    subprocess.run([*command, str(SOURCE)], check=True)
    bench = Bench(name, path)
    yield bench
    bench.set("gone", 0)
    bench.set("stalled", 0)
    for device in bench.devices:
        device.close()
