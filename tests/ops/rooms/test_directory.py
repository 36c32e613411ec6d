from __future__ import annotations

import asyncio
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_ops.rooms.directory import Lease, LeaseError, LocalDirectory

pytestmark = pytest.mark.live  # a loop of asyncio runs coroutines that never wait

DURATION = 10.0


@dataclass(frozen=True)
class Step:
    """What one of several processes does, and how long after the step before."""

    after: float
    who: int
    what: str


STEPS = st.lists(
    st.builds(
        Step,
        st.sampled_from([0.0, 1.0, 4.0, 10.0, 11.0]),
        st.integers(0, 3),
        st.sampled_from(["claim", "renew", "release"]),
    ),
    max_size=40,
)


async def play(steps: list[Step]) -> None:
    directory, now = LocalDirectory(DURATION), 0.0
    leases: dict[int, Lease] = {}
    epochs: list[int] = []
    for step in steps:
        now += step.after
        before = directory.owner("room", now)
        try:
            if step.what == "claim":
                lease = leases[step.who] = await directory.claim("room", f"p{step.who}", now)
                assert before is None
                epochs.append(lease.epoch)
            elif step.who in leases and step.what == "renew":
                renewed = leases[step.who] = await directory.renew(leases[step.who], now)
                # Only the owner stays it, with the epoch it had.
                assert before is not None
                assert renewed.epoch == before.epoch == epochs[-1]
                assert renewed.until == now + DURATION
            elif step.who in leases:
                await directory.release(leases[step.who])
                # Who is not the owner ends nobody's lease.
                if before is not None and leases[step.who].epoch != before.epoch:
                    assert directory.owner("room", now) == before
        except LeaseError:
            pass
        owner = directory.owner("room", now)
        assert owner is None or (owner.epoch == epochs[-1] and now < owner.until)
    assert epochs == sorted(set(epochs))


@given(STEPS)
def test_a_room_has_one_owner_at_a_time_and_each_has_a_higher_epoch(steps: list[Step]) -> None:
    asyncio.run(play(steps))


def test_who_has_not_renewed_in_time_is_the_owner_no_more() -> None:
    async def late() -> None:
        directory = LocalDirectory(DURATION)
        lease = await directory.claim("room", "a", 0.0)
        with pytest.raises(LeaseError, match=r"room room: owned by a for 4\.0 s"):
            await directory.claim("room", "b", 6.0)
        other = await directory.claim("room", "b", 10.0)
        assert other.epoch > lease.epoch
        with pytest.raises(LeaseError, match="no more owned by a"):
            await directory.renew(lease, 10.5)

    asyncio.run(late())
