from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from cohaptic.status.report import TouchStatus
from cohaptic.status.table import (
    status_notes,
    status_table,
    status_view,
)

WELL = TouchStatus(
    name="ann", state="touching", force=4.36, felt_from_others=-1.2, indentation=0.0123,
    k_o=251.0, k_h=251.0, max_stiffness=2000.0, law="predictive", round_trip=0.161, jitter=0.003,
    clock_offset=0.0012, clock_error=0.08, loop_hz=999.6, loop_late_p99=2.4e-4,
)  # fmt: skip
SOFT = WELL.model_copy(update={"name": "bob", "k_o": 5000.0, "k_h": 2000.0})


def shown(*users: TouchStatus, width: int) -> str:
    console = Console(width=width)
    with console.capture() as capture:
        console.print(status_view(users, width=width))
    return capture.get()


@given(
    st.integers(60, 220),
    st.sampled_from(["connecting", "server silent", "touching"]),
    st.text("abcdefgh", min_size=1, max_size=12),
    st.floats(0.0, 99.0),
    st.none() | st.floats(0.0, 20.0),
    st.booleans(),
)
def test_nothing_is_cut_off_at_any_width(
    width: int, state: str, name: str, force: float, along: float | None, soft: bool
) -> None:
    user = (SOFT if soft else WELL).model_copy(
        update={"name": name, "state": state, "force": force, "along": along}
    )
    text = shown(user, width=width)
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    for always in (name, state, f"{force:.2f} N"):
        assert always in text


@given(
    st.integers(60, 200),
    st.floats(0.0, 99.0),
    st.floats(-9.0, 9.0),
    st.floats(0.0, 0.999),
    st.sampled_from(["connecting", "server silent", "touching"]),
)
def test_columns_stay_while_numbers_change(
    width: int, force: float, felt: float, round_trip: float, state: str
) -> None:
    later = WELL.model_copy(
        update={"force": force, "felt_from_others": felt, "round_trip": round_trip, "state": state}
    )
    first, second = (status_table([user], width=width) for user in (WELL, later))
    assert [c.header for c in first.columns] == [c.header for c in second.columns]


@pytest.mark.parametrize("width", [80, 100, 120, 160])
def test_a_device_softer_than_the_object_is_told_at_every_width(width: int) -> None:
    text = shown(WELL, SOFT, width=width)
    assert "bob: device renders 2,000 of 5,000 N/m" in text
    assert "ann: device" not in text
    if "K_o" in text:
        assert text.count("2,000 of 5,000 N/m") == 2


def test_a_force_above_the_limit_of_a_hand_and_a_fault_are_told() -> None:
    cut = TouchStatus(name="left", state="touching", wanted=5.1, max_force=3.3, fault="")
    assert status_notes([cut]) == ["left: gives 3.3 of 5.1 N"]
    assert status_notes([cut.model_copy(update={"wanted": 3.3})]) == []
    assert status_notes([cut.model_copy(update={"state": "free"})]) == []
    fault = TouchStatus(name="left", state="fault", fault="the loop stood still for 50 ms")
    assert status_notes([fault]) == ["left: force off: the loop stood still for 50 ms"]
