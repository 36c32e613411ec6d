"""3D Systems Touch and Phantoms, through the HD library of OpenHaptics.

Frame of the library: right, up, toward the user, in millimetres. The servo thread of the library
calls this driver back once a millisecond. The callback copies the state out and the force in, and
is the watchdog: the force is zero if the loop has written nothing for `SILENCE`.
"""

from __future__ import annotations

import ctypes
from typing import Any

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, is_finite
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, place, placed_info
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_drivers.vendor.library import function, load

_NAME = "touch"
_FILES = {"win32": "hd.dll", "": "libHD.so"}
_WHERE = "OpenHaptics and the driver of the device (support.3dsystems.com)"
SILENCE = 0.02  # s; after a longer silence of servo thread or loop the hand feels no force
GIVE_UP = 0.25  # s; after a longer silence of the servo thread the device counts as gone
_FIRST = 2.0  # s to wait for the first callback of the servo thread
_FARTHEST = 1.0  # m; an arm reaches half of it

# Numbers of the library's interface, version 3.
_BUTTONS, _POSITION, _VELOCITY, _FORCE, _FORCE_OUTPUT = 0x2000, 0x2050, 0x2051, 0x2700, 0x4000
_CONTINUE, _DONE, _BAD_HANDLE = 1, 0, 0xFFFFFFFF
_MAX_PRIORITY = 65535
_FAULTS = {
    0x0200: "its motors are too warm; let it rest for some minutes",
    0x0201: "it was told more force than it has",
    0x0202: "its force changed too fast for its own limit",
    0x0203: "it moved faster than its own limit",
    0x0300: "it reports a fault",
    0x0302: "it does not answer any more; see to its cable and power",
}

# Largest force [N], stiffness [N/m] and damping [N s/m] that the authors of CHAI3D found usable.
_MODELS = {
    "touch": (3.3, 400.0, 4.0),
    "omni": (3.3, 700.0, 5.0),
    "desktop": (7.9, 1000.0, 5.0),
    "premium": (8.5, 800.0, 5.0),
}


class _ErrorInfo(ctypes.Structure):
    _fields_ = (("code", ctypes.c_uint), ("internal", ctypes.c_int), ("device", ctypes.c_uint))


class Touch:
    """A Touch or Phantom in its own frame: right, away from the user, up.

    Args:
        library: The library of OpenHaptics.
        handle: Number by which the library identifies the device.
        clock: Clock that times the silence of servo thread and loop.
    """

    def __init__(self, library: ctypes.CDLL, handle: int, info: DeviceInfo, clock: Clock) -> None:
        self.info = info
        self._library, self._handle, self._clock = library, handle, clock
        self._heard: tuple[float, Vec3, Vec3, int] | None = None
        self._given, self._at = ZERO, clock.now()
        self._fault = ""
        self._closed = False
        self._position, self._velocity = (ctypes.c_double * 3)(), (ctypes.c_double * 3)()
        self._force, self._buttons = (ctypes.c_double * 3)(), ctypes.c_int()
        # A reference is kept, because the library calls it for as long as it is scheduled.
        self._callback = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)(self._servo)
        schedule = function(library, _NAME, "hdScheduleAsynchronous")
        schedule.restype = ctypes.c_ulong
        self._scheduled = schedule(self._callback, None, ctypes.c_ushort(_MAX_PRIORITY))

    @property
    def started(self) -> bool:
        """Whether the servo thread has delivered a first state."""
        return self._heard is not None

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the tip.

        Raises:
            DeviceError: The device is gone or closed, or its state is impossible.
        """
        heard = self._check()
        at, position, velocity, buttons = heard
        age = self._clock.now() - at
        if age > GIVE_UP:
            problem = f"its servo thread has been silent for {1e3 * age:.0f} ms"
            raise DeviceError(_NAME, problem, "see to its cable and power")
        return DeviceSample(position, velocity, buttons=buttons, fresh=age <= SILENCE)

    def write(self, force: Vec3) -> None:
        """Apply `force` [N] in the next callback of the servo thread; raise as `read`."""
        self._check()
        self._given, self._at = force if is_finite(force) else ZERO, self._clock.now()

    def release(self) -> None:
        """Set the force on the hand to zero; may be called from another thread."""
        self._given = ZERO

    def close(self) -> None:
        """Set the force to zero, stop the servo thread, release the device; may be called twice."""
        if not self._closed:
            self._given, self._closed = ZERO, True
            self._library.hdStopScheduler()
            self._library.hdUnschedule(ctypes.c_ulong(self._scheduled))
            self._library.hdDisableDevice(self._handle)

    def _check(self) -> tuple[float, Vec3, Vec3, int]:
        if self._closed or self._heard is None:
            raise DeviceError(_NAME, "it is closed", "open it again")
        if self._fault:
            raise DeviceError(_NAME, self._fault)
        return self._heard

    def _servo(self, _data: object) -> int:
        """Copy the state out and the force in; the servo thread calls this back."""
        library, handle = self._library, self._handle
        library.hdBeginFrame(handle)
        library.hdGetDoublev(_POSITION, self._position)
        library.hdGetDoublev(_VELOCITY, self._velocity)
        library.hdGetIntegerv(_BUTTONS, ctypes.byref(self._buttons))
        now = self._clock.now()
        idle = self._closed or bool(self._fault) or now - self._at > SILENCE
        right, away, up = ZERO if idle else self._given
        self._force[:] = [right, up, -away]
        library.hdSetDoublev(_FORCE, self._force)
        library.hdEndFrame(handle)
        self._learn(now)
        code = library.hdGetError().code
        if code and not self._fault:
            self._fault = _FAULTS.get(code, f"its library reports error 0x{code:04x}")
        return _DONE if self._closed else _CONTINUE

    def _learn(self, now: float) -> None:
        x, y, z = (1e-3 * each for each in self._position)
        u, v, w = (1e-3 * each for each in self._velocity)
        whole = is_finite((x, y, z)) and is_finite((u, v, w))
        if not whole or max(abs(x), abs(y), abs(z)) > _FARTHEST:
            self._fault = f"its library tells {(x, y, z)} m, which cannot be"
            return
        self._heard = (now, (x, -z, y), (u, -w, v), self._buttons.value)


def open_touch(config: DeviceConfig, clock: Clock | None = None) -> Placed:
    """Open the device of a configuration; raise DeviceError if that fails."""
    choice, clock = config.choice, clock or SystemClock()
    library = _library(choice.text("library"))
    name = choice.text("id")
    handle = library.hdInitDevice(name.encode() if name else None)
    if handle == _BAD_HANDLE or library.hdGetError().code:
        raise DeviceError(
            _NAME,
            f"OpenHaptics cannot open {name or 'its default device'}",
            "plug it in, pair and calibrate it with the maker's Touch Setup and Diagnostic",
        )
    library.hdEnable(_FORCE_OUTPUT)
    device = Touch(library, handle, _bare_info(choice), clock)
    library.hdStartScheduler()
    end = clock.now() + _FIRST
    while not device.started and clock.now() < end:
        clock.sleep_until(clock.now() + 0.001)
    if not device.started:
        device.close()
        problem = "the servo thread of OpenHaptics does not start"
        raise DeviceError(_NAME, problem, "quit other programs that use the device")
    return place(device, config, middle=ZERO)


def find_touch() -> list[Found]:
    """Check that OpenHaptics is installed; return no devices, because OpenHaptics cannot list them.

    Raises:
        DeviceError: OpenHaptics is missing.
    """
    _library("")
    return []


def _library(path: str) -> Any:
    library = load(_NAME, _FILES, path, _WHERE)
    pointer = ctypes.POINTER(ctypes.c_double)
    signatures: tuple[tuple[str, list[Any], Any], ...] = (
        ("hdInitDevice", [ctypes.c_char_p], ctypes.c_uint),
        ("hdGetError", [], _ErrorInfo),
        ("hdEnable", [ctypes.c_uint], None),
        ("hdStartScheduler", [], None),
        ("hdStopScheduler", [], None),
        ("hdBeginFrame", [ctypes.c_uint], None),
        ("hdEndFrame", [ctypes.c_uint], None),
        ("hdGetDoublev", [ctypes.c_uint, pointer], None),
        ("hdSetDoublev", [ctypes.c_uint, pointer], None),
        ("hdGetIntegerv", [ctypes.c_uint, ctypes.POINTER(ctypes.c_int)], None),
        ("hdUnschedule", [ctypes.c_ulong], None),
        ("hdDisableDevice", [ctypes.c_uint], None),
    )
    for name, arguments, result in signatures:
        found = function(library, _NAME, name)
        found.argtypes, found.restype = arguments, result
    return library


def _bare_info(choice: DeviceChoice) -> DeviceInfo:
    force, stiffness, damping = _MODELS[choice.one_of("model", _MODELS, "touch")]
    return DeviceInfo(
        _NAME, force, stiffness, max_damping=damping, switch=True, latency=0.002, lets_go=SILENCE
    )


def _info(choice: DeviceChoice) -> DeviceInfo:
    return placed_info(choice, _bare_info(choice))


KIND = DeviceKind(
    _NAME,
    "a 3D Systems Touch or Phantom, through OpenHaptics",
    (
        ("model", f"{', '.join(_MODELS)}; the limits of a Touch if it is not given"),
        ("id", "name of the device in the maker's setup, where there are several"),
        ("library", "file of the maker's library, where the system does not find it"),
        *PLACING_OPTIONS,
    ),
    _info,
    open_touch,
    find_touch,
)
