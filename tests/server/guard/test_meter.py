from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.sources import Meter

LIMITS = Limits()


@given(st.floats(10.0, 200.0), st.floats(0.0, 10.0))
def test_no_honest_client_is_refused_whatever_its_rate_and_however_its_path_stalls(
    hz: float, stall: float
) -> None:
    """A stall of up to 10 s, after which TCP gives up, delivers all samples in a few reads."""
    meter, now = Meter(LIMITS, hz), 0.0
    for _ in range(200):
        now += 1.0 / hz
        assert meter.sample(now) is None
    now += stall
    assert meter.read(round(stall * hz), round(stall * hz), 0, 2, now) is None
    for _ in range(200):
        now += 1.0 / hz
        assert meter.sample(now) is None


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        (
            (721, 0, 0, 0),
            "number of samples is 'too many: 721 more'; expected at most 120 a second",
        ),
        ((1, 0, 181, 0), "number of control messages is 'too many: 181 more'"),
        ((1, 3001, 0, 0), "number of rows is 'too many: 3001 more'; expected at most 300 a second"),
        ((0, 0, 0, 41), "number of pings and pongs is 'too many: 41 more'; expected at most 4 a"),
    ],
)
def test_who_sends_too_much_is_told_what_and_how_much(
    counts: tuple[int, int, int, int], words: str
) -> None:
    error = Meter(LIMITS, 60.0).read(*counts, now=0.0)
    assert error is not None
    assert words in str(error)
    assert error.code is CloseCode.TOO_MANY


def test_reads_that_bring_nothing_whole_have_a_price() -> None:
    """A frame that comes byte by byte costs as many reads of the socket."""
    meter = Meter(LIMITS, 60.0)
    reads = sum(meter.read(0, 0, 0, 0, 0.0) is None for _ in range(5000))
    assert reads == 60.0 * LIMITS.samples.burst
    assert meter.sample(0.0) is not None
