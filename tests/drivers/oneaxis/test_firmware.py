"""The firmware core by attack: whatever comes, its motor is within its limit, and lets go."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_drivers.oneaxis.frames import (
    Reader,
    Report,
    command,
    crc16,
    identify,
)

if sys.platform == "win32":
    pytest.skip("its library is made as on POSIX", allow_module_level=True)

from tests.drivers.oneaxis.firmware import (
    LIMIT,
    RAMP,
    SOURCES,
    WARNINGS,
    WATCHDOG,
    Rig,
    compiler,
)

pytestmark = pytest.mark.live

# Bytes as they may come: none of the protocol, whole frames, frames that were cut off or changed.
_FRAMES = st.builds(command, st.integers(0, 255), st.floats(-40.0, 40.0)) | st.builds(
    identify, st.integers(0, 255)
)


def _cut(frame: bytes, size: int) -> bytes:
    return frame[:size]


def _changed(frame: bytes, at: int, byte: int) -> bytes:
    at %= len(frame)
    return frame[:at] + bytes([byte]) + frame[at + 1 :]


_CUT = st.builds(_cut, _FRAMES, st.integers(0, 6))
_CHANGED = st.builds(_changed, _FRAMES, st.integers(0, 6), st.integers(0, 255))
_BYTES = st.binary(max_size=40) | _FRAMES | _CUT | _CHANGED
# us; some longer than the watchdog, and a clock that begins near the end of its range
_PAUSES = (
    st.integers(0, 10_000) | st.integers(0, 200_000) | st.sampled_from([50_000, 4_300_000_000])
)
_STARTS = st.sampled_from([0, 2**32 - 300_000, 2**31 - 100_000])
_SILENCE = 1000 * WATCHDOG  # us


@given(_STARTS, st.lists(st.tuples(_BYTES, _PAUSES), max_size=30))
def test_no_bytes_give_a_current_above_the_limit_or_one_that_stays(
    start: int, script: list[tuple[bytes, int]]
) -> None:
    rig, now, reader = Rig(), start, Reader()
    heard = begun = None
    for data, pause in script:
        reported = reader.take(rig.receive(data, 1e-6 * now))
        assert reader.skipped == 0  # what it answers are whole frames
        if any(isinstance(each, Report) for each in reported):
            begun = now if heard is None or now - heard > _SILENCE else begun
            heard = now
        end = now + pause
        while True:
            current, silent = abs(rig.drive(1e-6 * now)), heard is None or now - heard > _SILENCE
            limit = (
                0 if silent or begun is None else min(LIMIT, LIMIT * 1e-6 * (now - begun) / RAMP)
            )
            assert current <= limit
            assert all(
                abs(each.current) <= 1e-3 * LIMIT for each in reported if isinstance(each, Report)
            )
            if now >= end:
                break
            # A shell looks often, until nothing can happen any more.
            now = end if end - now > 1_000_000 else min(end, now + 4000)
    assert rig.drive(1e-6 * (now + _SILENCE + 1)) == 0
    rig.close()


def test_a_silence_of_any_length_does_not_bring_a_current_back() -> None:
    """The clock runs over after 71.6 minutes: what was long ago must not become a moment ago."""
    rig = Rig()
    drive_fully(rig)
    for ago in (0.051, 1.0, 4294.9, 4294.967296 + 0.01, 8589.9):
        assert rig.drive(1.0 + ago) == 0
    rig.close()


def drive_fully(rig: Rig) -> None:
    """Until its ramp is over, at 1 s."""
    for k in range(1001):
        rig.receive(command(k, 1.0), 1e-3 * k)
    assert rig.drive(1.0) == LIMIT


def test_it_starts_along_a_ramp_and_so_it_does_after_a_silence() -> None:
    rig = Rig()
    for begin in (0.0, 2.0):
        currents: list[int] = []
        for k in range(700):
            now = begin + 1e-3 * k
            rig.receive(command(k, 0.3), now)
            currents.append(rig.drive(now))
        assert currents[0] == 0
        assert currents == sorted(currents)
        assert max(b - a for a, b in pairwise(currents)) <= 2  # mA in a millisecond
        assert currents.index(300) == pytest.approx(300, abs=2)  # of 500 mA in 500 ms
    rig.close()


@pytest.mark.parametrize(("limit", "watchdog"), [(1001, 50), (500, 19), (500, 101), (500, 0)])
def test_figures_that_nobody_can_mean_are_no_motor(limit: int, watchdog: int) -> None:
    rig = Rig(limit, watchdog)
    for k in range(1000):
        rig.receive(command(k, 1.0), 1e-3 * k)
        assert rig.drive(1e-3 * k) == 0
    rig.close()


@given(st.lists(st.integers(-200, 200), max_size=60))
def test_turns_of_a_sensor_that_begins_anew_are_counted(steps: list[int]) -> None:
    rig, place = Rig(), 500
    rig.wrap(500, 1000)
    for step in steps:
        place += step
        rig.wrap(place % 1000, 1000)
        assert rig.counts == place - 500
    rig.close()


@pytest.mark.parametrize("raw", [900, 1000, 65535])
def test_a_sensor_that_cannot_be_believed_switches_the_motor_off_for_ever(raw: int) -> None:
    rig = Rig()
    rig.wrap(400, 1000)
    drive_fully(rig)
    rig.wrap(raw, 1000)
    assert rig.drive(1.0) == 0
    for k in range(1000):
        answer = rig.receive(command(k, 0.5), 1.0 + 1e-3 * k)
        (reported,) = Reader().take(answer)
        assert isinstance(reported, Report)
        assert reported.faulty
        assert reported.current == rig.drive(1.0 + 1e-3 * k) == 0
    rig.close()


def test_a_bridge_gets_a_share_of_its_voltage() -> None:
    rig = Rig()
    assert [rig.duty(ma) for ma in (0, 500, -500, 1000, 32767, -32768)] == [
        0,
        127,
        127,
        255,
        255,
        255,
    ]
    rig.close()


def test_both_sides_have_the_same_checksum_and_it_is_the_published_one() -> None:
    assert crc16(b"123456789") == 0x29B1  # the check value of CRC-16/CCITT-FALSE
    rig = Rig()
    assert len(rig.receive(identify(0), 0.0)) == 24
    rig.close()


def test_the_core_has_no_warning_as_c_and_needs_no_arduino(tmp_path: Path) -> None:
    core = SOURCES / "axis_core.c"
    made = str(tmp_path / "core.o")
    subprocess.run([compiler(), "-std=c99", *WARNINGS, "-c", str(core), "-o", made], check=True)
    includes = re.findall(
        r"#include (\S+)", core.read_text() + (SOURCES / "axis_core.h").read_text()
    )
    assert set(includes) <= {'"axis_core.h"', "<string.h>", "<stdbool.h>", "<stdint.h>"}


def test_the_shell_is_cpp_that_fits_the_core(tmp_path: Path) -> None:
    """No compiler for the board is here: Arduino's names are declared, and the rest is read."""
    (tmp_path / "avr").mkdir()
    (tmp_path / "avr" / "wdt.h").write_text(
        "enum { WDTO_60MS };void wdt_enable(int);void wdt_reset();\n"
    )
    (tmp_path / "Arduino.h").write_text(
        "#include <stdint.h>\n#include <stddef.h>\n"
        "enum { A2 = 16, OUTPUT = 1, HIGH = 1, LOW = 0 };\n"
        "extern volatile uint8_t TCCR0B, TCCR1A, TCCR1B, ADCSRA;extern volatile uint16_t TCNT1;\n"
        "void pinMode(uint8_t, uint8_t);void digitalWrite(uint8_t, uint8_t);\n"
        "void analogWrite(uint8_t, int);int analogRead(uint8_t);\n"
        "struct Stream { void begin(unsigned long);int available();int read();\n"
        "int availableForWrite();size_t write(const uint8_t *, size_t); };extern Stream Serial;\n"
    )
    shell = str(SOURCES / "one_axis_board.ino")
    command = [compiler("c++"), "-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    subprocess.run([*command, f"-I{tmp_path}", f"-I{SOURCES}", "-x", "c++", shell], check=True)
