from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_server.room.latency import UserLatency

steps = st.lists(
    st.tuples(
        st.sampled_from(["up", "down"]),
        st.floats(0.0, 0.3),
        st.none() | st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 0.5)),
    ),
    max_size=40,
)


@given(steps, st.integers(0, 9))
def test_order_is_kept_whatever_is_set_and_nothing_is_lost(
    said: list[tuple[str, float, tuple[float, float] | None]], seed: int
) -> None:
    path = UserLatency(seed)
    now, number = 0.0, 0
    sent: dict[str, list[str]] = {"up": [], "down": []}
    came: dict[str, list[str]] = {"up": [], "down": []}
    pushed: dict[str, float] = {}
    limits: dict[str, tuple[float, float]] = {}
    for way, pause, change in said:
        now += pause
        if change is not None:
            path.set(LinkSettings(*change))
        number += 1
        (path.push_up if way == "up" else path.push_down)(str(number), now)
        sent[way].append(str(number))
        pushed[str(number)] = now
        limits[str(number)] = (path.link.delay, path.link.jitter)
        for direction, due in (("up", path.due_up(now)), ("down", path.due_down(now))):
            for data in due:
                came[direction].append(str(data))
                # Never before its own delay, which was that of the moment when it was sent.
                assert now >= pushed[str(data)] + limits[str(data)][0] - 1e-12
    after = path.next_due()
    assert (after is None) == (came == sent)
    for direction, due in (("up", path.due_up(now + 60.0)), ("down", path.due_down(now + 60.0))):
        came[direction] += [str(data) for data in due]
    assert came == sent


@given(st.floats(0.01, 1.0), st.floats(0.0, 0.5), st.floats(0.0, 1.0))
def test_it_stops_when_it_is_set_to_zero_after_what_was_in_flight(
    delay: float, jitter: float, later: float
) -> None:
    path = UserLatency(3)
    path.set(LinkSettings(delay, jitter))
    path.push_up("first", 0.0)
    path.set(LinkSettings())
    path.push_up("second", later * delay)
    assert not path.gone
    first = path.next_due()
    assert first is not None
    assert delay <= first <= delay + jitter
    # Stream semantics: the second never overtakes, and owes nothing more.
    assert path.due_up(max(first, later * delay)) == ["first", "second"]
    assert path.gone
    path.push_up("third", first + 1.0)
    assert path.due_up(first + 1.0) == ["third"]
