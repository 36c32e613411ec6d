"""The server's clock as a connection knows it that sends no samples."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.network.marks import Stamps, mark_of
from cohaptic_client.network.server_clock import ClockReading, ServerClock
from cohaptic_client.network.timing import WINDOW

delays = st.floats(0.0, 0.5)


@given(st.lists(st.tuples(delays, delays, delays), min_size=3, max_size=40), st.floats(-1e5, 1e5))
def test_the_error_is_within_its_bound_whatever_the_delays(
    ways: list[tuple[float, float, float]], offset: float
) -> None:
    """Of each time that comes, and of each ping and its answer."""
    clock, now = ServerClock(), 100.0
    for down, up, back in ways:
        clock.heard(now - down + offset, now)
        clock.answered(up + back, now)
        now += 0.05
    reading = clock.reading
    assert reading is not None
    shortest = min(down for down, _, _ in ways)
    assert reading.error == 0.5 * min(up + back for _, up, back in ways)
    # The bound holds where the quickest time came no later than the shortest round trip.
    if shortest <= 2.0 * reading.error:
        assert abs(reading.to_server - offset) <= reading.error + 1e-6


@given(delays, st.floats(-1e5, 1e5))
def test_a_link_that_takes_as_long_in_both_directions_gives_no_error(
    way: float, offset: float
) -> None:
    clock = ServerClock()
    for k in range(3):
        assert clock.reading is None
        clock.heard(100.0 + k + offset, 100.0 + k + way)
        clock.answered(2.0 * way, 100.0 + k + way)
    reading = clock.reading
    assert reading is not None
    assert abs(reading.to_server - offset) < 1e-6


def test_a_clock_that_drifts_is_followed() -> None:
    clock, drift = ServerClock(), 1e-4
    for k in range(3600):
        clock.heard(k * (1.0 - drift), k + 0.01)
        clock.answered(0.02, k + 0.01)
    reading = clock.reading
    assert reading is not None
    assert abs(reading.to_server + 3600 * drift) < 2.0 * WINDOW * drift + 1e-3


@given(st.lists(st.tuples(st.floats(0.0, 0.01), st.floats(-0.2, 0.2)), min_size=2, max_size=20))
def test_marks_keep_their_order_whatever_becomes_of_the_estimate(
    steps: list[tuple[float, float]],
) -> None:
    stamps, now, found = Stamps(), 50.0, list[float]()
    for gap, to_server in steps:
        now += gap
        mark = stamps.on(mark_of("trial", {}), now, now + 0.1, ClockReading(to_server, 0.2))
        assert mark.at is not None
        found.append(mark.at)
    assert found == sorted(found)
