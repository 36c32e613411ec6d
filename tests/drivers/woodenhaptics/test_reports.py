from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_drivers.woodenhaptics.reports import (
    GENERATIONS,
    LINE,
    Reported,
    command_line,
    input_size,
    read_answer,
)

int16 = st.integers(-(2**15), 2**15 - 1)
milliamps = st.tuples(*[st.floats(-6000.0, 6000.0)] * 3)


@given(milliamps)
def test_a_command_is_one_line_that_the_firmware_takes(wanted: tuple[float, float, float]) -> None:
    line = command_line(wanted)
    text, end, rest = line.partition(b"]")
    assert len(line) >= LINE or len(line) == LINE
    assert end == b"]"
    assert rest.strip(b"\n\r\0") == b""  # all that may follow
    assert [int(each) for each in text[1:].split(b",")] == [round(each) for each in wanted]


@pytest.mark.parametrize(("error", "reported"), [(1, 0), (7, 0), (8, 8), (129, 128), (1031, 1024)])
def test_errors_of_the_wrist_are_no_errors_of_the_tip(error: int, reported: int) -> None:
    answer = read_answer(f"[3,1,2,3,0,0,0,{error}]".encode())
    assert answer is not None
    assert answer.error == reported


@given(st.binary(max_size=80))
def test_any_bytes_are_an_answer_or_none(line: bytes) -> None:
    reported = read_answer(line)
    assert reported is None or line.count(b",") == 7


@pytest.mark.parametrize("name", GENERATIONS)
@given(int16, int16, int16)
def test_a_report_is_read_and_a_command_is_its_like(name: str, a: int, b: int, c: int) -> None:
    reports = GENERATIONS[name]
    body = struct.pack("<3h", a, b, c).ljust(reports.size, b"\0")
    assert reports.decode(body) == Reported((a, b, c))
    assert reports.decode(body + b"\0") is None
    assert reports.decode(body[:-1]) is None
    command = reports.encode((1000.0, -2000.0, 3000.4))
    assert len(command) == reports.size + 1
    assert struct.unpack_from("<3h", command, 1) == (1000, -2000, 3000)
    assert not any(command[7:])


@given(st.binary(max_size=100))
def test_any_descriptor_has_a_length(data: bytes) -> None:
    assert input_size(data) >= 0
