from __future__ import annotations

import math

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.guard.limits import Budget, Limits


def test_an_owner_changes_what_is_named_and_nothing_else() -> None:
    changed = Limits().changed(["connections=10:20", "open=3", "samples=0.5:1"])
    assert changed == Limits(connections=Budget(10, 20), open=3, samples=Budget(0.5, 1))


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ("bananas=3", "limit is 'bananas=3'; it must be NAME=NUMBER of: samples, rows, texts, "),
        ("open", "limit open is ''; it must be a whole number"),
        ("open=many", "limit open is 'many'; it must be a whole number"),
        ("joins=5", "limit joins is '5'; it must be RATE:BURST, such as 100:600"),
        ("joins=1.2.3:4", "limit joins is '1.2.3:4'; it must be RATE:BURST"),
        ("joins=0:4", "limit joins is 0 a second and 4 at once; it must be above 0"),
        ("joins=1:0.5", "limit joins is 1 a second and 0.5 at once; it must be at least 1"),
        ("unread=-1", "limit unread is -1; it must be above 0"),
    ],
)
def test_a_limit_that_cannot_be_is_refused_by_its_name(wish: str, words: str) -> None:
    with pytest.raises(SettingError) as caught:
        Limits().changed([wish])
    assert words in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0, 0.0])
def test_no_number_switches_a_limit_off(value: float) -> None:
    with pytest.raises(SettingError, match="limit texts"):
        Limits(texts=Budget(value, 10.0))
