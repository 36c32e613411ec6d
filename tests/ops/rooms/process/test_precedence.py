from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_ops.rooms.process.room_process import CALM, LARGEST, LESS, Precedence


@given(st.lists(st.floats(0.0, 2.0), max_size=60))
def test_who_takes_too_much_goes_first_only_after_a_calm_of_its_own(shares: list[float]) -> None:
    precedence, calm = Precedence(), None
    for now, share in enumerate(shares):
        if share > LARGEST:
            calm = 0.0
        elif calm is not None and share <= LESS:
            calm += 1.0
        elif calm is not None:
            calm = 0.0
        precedence.see(share, float(now))
        if share > LARGEST:
            assert not precedence.first
        if calm is not None and calm <= CALM:
            assert not precedence.first
        if calm is not None and calm > CALM:
            assert precedence.first
            calm = None
