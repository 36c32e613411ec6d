"""The firmware of `examples/one_axis_board`, compiled by the C compiler of this machine."""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from tests.give_up import give_up

SOURCES = Path(__file__).parents[3] / "examples" / "one_axis_board"
RIG = Path(__file__).with_name("rig.c")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror")

LIMIT = 500  # mA
WATCHDOG = 50  # ms
RAMP = 0.5  # s
COUNTS = 2000  # of a turn of the motor


def compiler(name: str = "cc") -> str:
    """Path of a compiler; gives the test up where there is none."""
    path = shutil.which(name) or shutil.which({"cc": "gcc", "c++": "g++"}[name])
    if path is None:
        give_up(f"there is no compiler {name}")
    return path


@functools.cache
def library() -> Any:
    """The rig of `rig.c` as a library."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.so"
        sanitised = ["-fsanitize=undefined", "-fno-sanitize-recover=all"]
        command = [compiler(), "-std=c99", "-O1", "-shared", "-fPIC", f"-I{SOURCES}", *sanitised]
        subprocess.run([*command, "-o", str(path), str(RIG), "-lm"], check=True)
        made = ctypes.CDLL(str(path))
    made.rig_new.restype = ctypes.c_void_p
    made.rig_new.argtypes = [ctypes.c_int] * 3 + [ctypes.c_double] * 2
    for name in ("rig_step", "rig_place", "rig_most"):
        getattr(made, name).restype = ctypes.c_double
    return made


class Rig:
    """A board, its motor, its handle and a hand on it; time is an argument [s].

    Args:
        limit: Of its current [mA].
        watchdog: Silence after which its motor is off [ms].
        newtons: Force at the handle for an ampere.
        per_metre: Counts of the handle's way.
    """

    def __init__(
        self,
        limit: int = LIMIT,
        watchdog: int = WATCHDOG,
        *,
        newtons: float = 6.0,
        per_metre: float = 80_000.0,
    ) -> None:
        self._c = library()
        new = self._c.rig_new(limit, watchdog, COUNTS, newtons, per_metre)
        self._rig = ctypes.c_void_p(new)
        self._answer = ctypes.create_string_buffer(24)

    def close(self) -> None:
        self._c.rig_free(self._rig)

    def receive(self, data: bytes, now: float) -> bytes:
        """Answers to these bytes."""
        answers = b""
        for byte in data:
            size = self._c.rig_receive(self._rig, byte, _us(now), self._answer)
            assert 0 <= size <= len(self._answer)
            answers += self._answer.raw[:size]
        return answers

    def drive(self, now: float) -> int:
        """Current of the motor [mA]."""
        return int(self._c.rig_drive(self._rig, _us(now)))

    def step(self, now: float, dt: float) -> float:
        """Move on by `dt`; the current [A]."""
        return float(self._c.rig_step(self._rig, _us(now), ctypes.c_double(dt)))

    def goal(self, place: float) -> None:
        """Where the hand wants the handle, away from the user [m]."""
        self._c.rig_goal(self._rig, ctypes.c_double(place))

    def turned(self) -> None:
        """Wire motor and sensor the other way round."""
        self._c.rig_turn(self._rig, ctypes.c_double(-1.0))

    def break_sensor(self) -> None:
        self._c.rig_break(self._rig)

    def press(self, pressed: bool) -> None:
        self._c.rig_press(self._rig, int(pressed))

    def wrap(self, raw: int, span: int) -> None:
        self._c.rig_wrap(self._rig, raw, span)

    def duty(self, milliamps: int, limit: int = 255) -> int:
        return int(self._c.rig_duty(self._rig, milliamps, limit))

    @property
    def counts(self) -> int:
        return int(self._c.rig_counts(self._rig))

    @property
    def place(self) -> float:
        """Of the handle, away from the user [m]."""
        return float(self._c.rig_place(self._rig))

    @property
    def limit(self) -> float:
        """Current that the motor ever had [A]."""
        return float(self._c.rig_most(self._rig))


def _us(now: float) -> ctypes.c_uint32:
    return ctypes.c_uint32(round(1e6 * now) & 0xFFFFFFFF)
