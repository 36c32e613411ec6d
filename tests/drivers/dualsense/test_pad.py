from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, is_finite, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_drivers.dualsense.cursor import FRONT, Room
from cohaptic_drivers.dualsense.pad import Pad
from cohaptic_drivers.dualsense.reports import OFF, Effects, Held

ROOM = Room(FRONT, depth=0.03, reach=0.2)
REST = Held((0.0, 0.0), (0.0, 0.0), 0)
PULLED = Held((0.0, 0.0), (0.0, 0.0), 255)
START, FULL = -0.11, 3.0  # m, N
PERIOD = 0.001  # s


class FakeLink:
    def __init__(self) -> None:
        self.reported: Held | None = None
        self.given: list[Effects] = []
        self.closed = 0
        self.released = 0
        self.trouble: DeviceError | None = None

    def poll(self) -> Held | None:
        if self.trouble is not None:
            raise self.trouble
        reported, self.reported = self.reported, None
        return reported

    def send(self, effects: Effects) -> None:
        if self.trouble is not None:
            raise self.trouble
        self.given.append(effects)

    def release(self) -> None:
        self.released += 1

    def close(self) -> None:
        self.closed += 1


def pad_on(link: FakeLink, first: Held = REST) -> Pad:
    return Pad(link, first, ROOM, start=START, full=FULL)


def played(
    pad: Pad, link: FakeLink, held: Held, seconds: float, *, force: Vec3 = ZERO, begin: float = 0.0
) -> list[DeviceSample]:
    """Samples of a pad that tells the same every 4 ms."""
    samples = list[DeviceSample]()
    for k in range(round(seconds / PERIOD)):
        if k % 4 == 0:
            link.reported = held
        samples.append(pad.read(begin + k * PERIOD))
        pad.write(force)
    return samples


def silent_for(pad: Pad, seconds: float, *, begin: float) -> DeviceSample:
    """The last sample of a pad that tells nothing."""
    return [pad.read(begin + k * PERIOD) for k in range(round(seconds / PERIOD))][-1]


def test_the_tip_follows_the_trigger_without_a_jump_between_reports() -> None:
    link = FakeLink()
    samples = played(pad_on(link), link, PULLED, 0.2)
    assert samples[0].position == pytest.approx((0.0, START, 0.0))
    assert samples[-1].position == pytest.approx((0.0, START + ROOM.depth, 0.0), abs=1e-6)
    for before, after in pairwise(samples):
        way = sub(after.position, before.position)
        assert way == pytest.approx(scale(after.velocity, PERIOD), abs=1e-12)
        assert norm(after.velocity) < 0.6


def test_a_force_against_the_pull_resists_from_where_it_began() -> None:
    link = FakeLink()
    pad = pad_on(link)
    played(pad, link, Held((0.0, 0.0), (0.0, 0.0), 100), 0.1)
    played(pad, link, PULLED, 0.5, force=(0.0, -1.5, 0.0), begin=0.1)
    # The contact began where the tip was at the first force, 0.5 mm and 4 steps after 100; the
    # trigger was ahead of it.
    assert link.given[-1] == Effects(104, 128, 0)
    played(pad, link, Held((0.0, 0.0), (0.0, 0.0), 90), 0.1, force=(0.0, -3.0, 0.0), begin=0.6)
    assert link.given[-1].start == 90
    assert link.given[-1].resistance == 255
    played(pad, link, REST, 0.5, begin=0.7)
    assert link.given[-1] == OFF


def test_a_silent_pad_stands_is_told_as_stale_and_then_as_gone() -> None:
    link = FakeLink()
    pad = pad_on(link)
    moving = Held((1.0, 0.0), (0.0, 0.0), 0)
    last = played(pad, link, moving, 0.1)[-1]
    assert last.fresh
    assert last.velocity[0] > 0.1
    stale = pad.read(0.13)
    assert not stale.fresh
    assert stale.velocity == ZERO
    assert stale.position == last.position
    assert silent_for(pad, 0.2, begin=0.131).position == last.position
    with pytest.raises(DeviceError, match=r"it has been silent for 2\d\d ms; see to its cable"):
        silent_for(pad, 0.05, begin=0.331)
    again = pad_on(link)
    played(again, link, moving, 0.1)
    again.read(0.13)
    link.reported = moving
    back = again.read(0.2)
    assert back.fresh
    assert norm(sub(back.position, last.position)) < 0.15 * 0.02 + 1e-9


def test_a_process_that_stood_still_does_not_take_the_pad_for_a_silent_one() -> None:
    """Its thread stood still as well, and has nothing to tell yet."""
    link = FakeLink()
    pad = pad_on(link)
    last = played(pad, link, PULLED, 0.1)[-1]
    assert pad.read(5.0).position == last.position
    link.reported = REST
    assert pad.read(5.001).fresh


@given(
    st.lists(
        st.tuples(
            st.integers(0, 255),
            st.floats(0.0, 0.05),
            st.tuples(st.floats(), st.floats(), st.floats()),
        ),
        max_size=20,
    )
)
def test_whatever_hands_clock_and_force_do_samples_are_finite(
    way: list[tuple[int, float, Vec3]],
) -> None:
    link, now = FakeLink(), 0.0
    pad = pad_on(link)
    for pull, dt, force in way:
        link.reported, now = Held((0.0, 1.0), (1.0, 1.0), pull), now + dt
        sample = pad.read(now)
        assert is_finite(sample.position)
        assert norm(sample.velocity) < 1.5
        pad.write(force)
        assert 0 <= link.given[-1].resistance <= 255
