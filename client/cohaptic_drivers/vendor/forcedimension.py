"""Devices of Force Dimension and the Novint Falcon, through the maker's DHD library.

Frame of the library: toward the user, the user's right, up, in metres and newtons. The library
holds the last force for ever, so the driver sets the watchdog in the device's firmware, if there is
one.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import replace
from typing import Any

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, is_finite
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, place, placed_info
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_drivers.vendor.library import function, load

_NAME = "forcedimension"
_FILES = {"win32": "dhd64.dll", "darwin": "libdhd.dylib", "": "libdhd.so"}
_WHERE = "the Force Dimension SDK, 3.16 or newer (forcedimension.com)"
# m; every pose of the three arms, folded or stretched, is within it; garbage is not.
_FARTHEST = 1.0
# Units of 125 us, 255 at most: 30 ms. The loop's own ramp begins earlier, after 20 ms.
_WATCHDOG = 240
_WATCHDOG_UNIT = 125e-6  # s

# Largest force [N], stiffness [N/m] and damping [N s/m] that the authors of CHAI3D found usable.
_MODELS = {
    "falcon": (8.0, 3000.0, 20.0),
    "omega": (12.0, 5000.0, 30.0),
    "delta": (20.0, 5000.0, 30.0),
    "sigma": (12.0, 4000.0, 30.0),
    "lambda": (12.0, 8000.0, 30.0),
}


class ForceDimension:
    """A device of Force Dimension in its own frame: right, away from the user, up.

    Args:
        library: The maker's library.
        number: Number by which the library identifies the open device.
        info: Abilities without `lets_go`, which follows from the watchdog.
        clock: Clock that shows whether a write is late; None for the system's clock.
    """

    def __init__(
        self, library: ctypes.CDLL, number: int, info: DeviceInfo, clock: Clock | None = None
    ) -> None:
        self._library, self._number = library, number
        self._clock = clock or SystemClock()
        self._before = watchdog_of(library, number)
        self.info = replace(info, lets_go=set_watchdog(library, number, _WATCHDOG))
        self._written = self._clock.now()
        self._closed = False
        # Functions and numbers that the loop uses in every period are made once, here.
        self._call = {
            name: function(library, _NAME, name)
            for name in ("dhdGetPosition", "dhdGetLinearVelocity", "dhdSetForce", "dhdGetButton")
        }
        self._call["dhdSetForce"].argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
        for name in ("dhdGetPosition", "dhdGetLinearVelocity"):
            pointer = ctypes.POINTER(ctypes.c_double)
            self._call[name].argtypes = [pointer] * 3 + [ctypes.c_byte]
        self._vector = (ctypes.c_double(), ctypes.c_double(), ctypes.c_double())

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the tip.

        Raises:
            DeviceError: The device is gone or closed, or its position is impossible.
        """
        position = self._vector_of("dhdGetPosition")
        velocity = self._vector_of("dhdGetLinearVelocity")
        whole = is_finite(position) and is_finite(velocity)
        if not whole or max(map(abs, position)) > _FARTHEST:
            raise DeviceError(_NAME, f"its library tells {position} m, which cannot be")
        button = self._call["dhdGetButton"](0, self._number)
        return DeviceSample(position, velocity, buttons=int(button > 0))

    def write(self, force: Vec3) -> None:
        """Give `force` [N] to the hand; raise DeviceError when the device is gone or closed."""
        if self._closed:
            raise DeviceError(_NAME, "it is closed", "open it again")
        now = self._clock.now()
        late, self._written = now - self._written > 0.9 * self.info.lets_go, now
        if late:
            # The watchdog may have switched the forces off, and they stay off until enabled again.
            # The force now rises from zero: `Placed` and the fault in the loop see to that.
            self._set_force(ZERO)
            self._library.dhdEnableForce(1, self._number)
        self._check(self._set_force(force if is_finite(force) else ZERO))

    def release(self) -> None:
        """Set the force on the hand to zero; may be called from another thread."""
        self._set_force(ZERO)

    def close(self) -> None:
        """Send zero force twice, disable forces, release the device; may be called twice."""
        if not self._closed:
            self._closed = True
            for _ in range(2):
                self._set_force(ZERO)
            self._library.dhdEnableForce(0, self._number)
            if self._before is not None:
                set_watchdog(self._library, self._number, self._before)
            self._library.dhdClose(self._number)

    def _set_force(self, force: Vec3) -> int:
        right, away, up = force
        return int(self._call["dhdSetForce"](-away, right, up, self._number))

    def _vector_of(self, name: str) -> Vec3:
        if self._closed:
            raise DeviceError(_NAME, "it is closed", "open it again")
        x, y, z = self._vector
        result = self._call[name](ctypes.byref(x), ctypes.byref(y), ctypes.byref(z), self._number)
        self._check(result)
        return (y.value, -x.value, z.value)

    def _check(self, result: int) -> None:
        # 1: not new since the last call; 2: motors at their limit, direction kept. Both are fine.
        if result < 0:
            raise DeviceError(
                _NAME, f"it is gone ({_last_error(self._library)})", "see to its cable and power"
            )


def watchdog_of(library: ctypes.CDLL, number: int) -> int | None:
    """Return the silence after which the device switches its forces off [125 us].

    The result is 0 if the device never does so, and None if the device or the library does not
    tell.
    """
    value = ctypes.c_ubyte()
    try:
        reported = library.dhdGetWatchdog(ctypes.byref(value), ctypes.c_byte(number))
    except AttributeError:  # a library of before 3.3.2
        return None
    return value.value if reported == 0 else None


def set_watchdog(library: ctypes.CDLL, number: int, value: int) -> float:
    """Set the silence after which the device switches its forces off [125 us]; 0 for never.

    Returns:
        The silence [s]; inf for never, and if the device or the library has no watchdog.
    """
    try:
        library.dhdEnableExpertMode()
        done = library.dhdSetWatchdog(ctypes.c_ubyte(value), ctypes.c_byte(number))
        library.dhdDisableExpertMode()
    except AttributeError:
        return math.inf
    return value * _WATCHDOG_UNIT if done == 0 and value > 0 else math.inf


def find_forcedimension() -> list[Found]:
    """Return the devices that the maker's library sees, without opening them.

    Raises:
        DeviceError: The library is missing.
    """
    count = int(_library("").dhdGetDeviceCount())
    return [Found(f"{_NAME}:number={k + 1}", "the maker's library") for k in range(count)]


def _library(path: str) -> Any:
    library = load(_NAME, _FILES, path, _WHERE)
    for name in ("dhdOpenID", "dhdGetDeviceCount", "dhdEnableForce", "dhdClose"):
        function(library, _NAME, name)
    return library


def open_forcedimension(config: DeviceConfig) -> Placed:
    """Open the device of a configuration; raise DeviceError if that fails."""
    choice = config.choice
    library = _library(choice.text("library"))
    count = int(library.dhdGetDeviceCount())
    wanted = int(choice.number("number", 1, 1, 16))
    if count < 1:
        advice = "plug it in and switch its power on; on Linux the SDK has the udev rule for it"
        raise DeviceError(_NAME, "its library finds no device", advice)
    if wanted > count:
        raise DeviceError(_NAME, f"there is no device {wanted}", f"devices are 1 to {count}")
    number = int(library.dhdOpenID(ctypes.c_byte(wanted - 1)))
    if number < 0:
        why = _last_error(library)
        advice = "quit other programs that use it; calibrate it with the SDK's HapticInit"
        raise DeviceError(_NAME, f"it cannot be opened ({why})", advice)
    library.dhdEnableForce(1, number)
    return place(ForceDimension(library, number, _bare_info(choice)), config, middle=ZERO)


def _last_error(library: ctypes.CDLL) -> str:
    say: Any = function(library, _NAME, "dhdErrorGetLastStr")
    say.restype = ctypes.c_char_p
    return (say() or b"no reason told").decode(errors="replace")


def _bare_info(choice: DeviceChoice) -> DeviceInfo:
    force, stiffness, damping = _MODELS[choice.one_of("model", _MODELS, "falcon")]
    return DeviceInfo(
        _NAME, force, stiffness, max_damping=damping, rate=4000.0, switch=True, latency=0.001
    )


def _info(choice: DeviceChoice) -> DeviceInfo:
    choice.number("number", 1, 1, 16)
    return placed_info(choice, _bare_info(choice))


KIND = DeviceKind(
    _NAME,
    "a device of Force Dimension or a Novint Falcon, through the maker's SDK",
    (
        ("model", f"{', '.join(_MODELS)}; the limits of the weakest if it is not given"),
        ("number", "of the device, where there are several, from 1"),
        ("library", "file of the maker's library, where the system does not find it"),
        *PLACING_OPTIONS,
    ),
    _info,
    open_forcedimension,
    find_forcedimension,
)
