"""What Prometheus reads, read back with its own parser."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
from prometheus_client.parser import text_string_to_metric_families

from cohaptic_ops.monitoring.exposition import exposition
from cohaptic_ops.monitoring.known import Known
from tests.ops.monitoring.some import room, ticking, times, user

Samples = dict[tuple[str, tuple[tuple[str, str], ...]], float]


def read(known: Known, now: float = 1.0) -> Samples:
    text = exposition(known, now).decode()
    found: Samples = {}
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            key = (sample.name, tuple(sorted(sample.labels.items())))
            assert key not in found
            found[key] = sample.value
    return found


def of(samples: Samples, name: str, **labels: str) -> float:
    return samples[f"cohaptic_{name}", tuple(sorted(labels.items()))]


def test_what_a_room_tells_is_there_in_its_units() -> None:
    line = room(
        ticks=600, missed=5, left_out=2, slept=90, cost=times(0.0004, 0.004, 3.0), users=(user(),),
        lag=0.25, coupling=1.5, limited={"depth": 1, "speed": 2}, refused={"room_full": 4},
        spent={"number of samples": 6}, received=10, sent=20, processor=1.25, memory=4096,
    )  # fmt: skip
    got = read(ticking(line))
    assert of(got, "ticks_total", room="main") == 600
    assert of(got, "ticks_missed_total", room="main") == 5
    assert of(got, "ticks_left_out_total", room="main") == 2
    assert of(got, "ticks_slept_total", room="main") == 90
    assert of(got, "room_lag_seconds", room="main") == 0.25
    assert of(got, "room_margin", room="main") == math.inf
    assert of(got, "forces_limited_total", room="main", reason="speed") == 2
    assert of(got, "refused_total", room="main", cause="room_full") == 4
    assert of(got, "budgets_spent_total", room="main", budget="number of samples") == 6
    assert of(got, "bytes_total", room="main", direction="sent") == 20
    assert of(got, "tick_duration_seconds_bucket", room="main", le="0.0005") == 1
    assert of(got, "tick_duration_seconds_bucket", room="main", le="0.005") == 2
    assert of(got, "tick_duration_seconds_bucket", room="main", le="0.25") == 2
    assert of(got, "tick_duration_seconds_bucket", room="main", le="+Inf") == 3
    assert of(got, "tick_duration_seconds_count", room="main") == 3
    assert math.isclose(of(got, "tick_duration_seconds_sum", room="main"), 3.0044)
    assert of(got, "user_delay_seconds", room="main", seat="1") == 0.05
    assert of(got, "user_samples_unused_ratio", room="main", seat="1") == 0.25
    assert of(got, "server_ready") == 1


@given(st.lists(st.text(min_size=1, max_size=40), min_size=1, max_size=16, unique=True))
def test_names_of_strangers_are_no_labels_however_many_come(names: list[str]) -> None:
    line = room(users=tuple(user(seat, name) for seat, name in enumerate(names, 1)))
    seats = room(users=tuple(user(seat, "x") for seat in range(1, len(names) + 1)))
    assert exposition(ticking(line), 1.0) == exposition(ticking(seats), 1.0)
