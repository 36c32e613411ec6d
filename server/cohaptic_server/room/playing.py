"""The samples of one hand, read in each tick at a time behind which they all have come."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from cohaptic.control.playout import LONGEST, NOT_PLAYED, Playout
from cohaptic.vec import Vec3, lerp
from cohaptic_server.world.state import Participant, Touch

# Of one hand, which wait; at 100 samples a second for `LONGEST` twice over. A client that sends
# more has its oldest left out.
_LARGEST: Final = 50
# Share of the way to the newer of two samples from which on what is read counts as an answer to the
# newer one's patch. On a link that does not waver the newest sample is read but for a millisecond.
_NEWER: Final = 0.9


# s; a sample is of a haptic period, which begins at any time within a millisecond. A line between
# two samples would cost a tenth of what moves at 20 Hz.
_AS_GOOD: Final = 0.0015


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of one hand.

    Args:
        waiting: Samples from the last one before the playing time on, oldest first.
        playout: When they are played.
        read_at: Time of the last tick [s].
    """

    waiting: tuple[Touch, ...] = ()
    playout: Playout = NOT_PLAYED
    read_at: float = -math.inf

    def heard(self, touch: Touch) -> Samples:
        """Return the samples with a new one.

        A client says itself when a sample was made. One whose clock stands still, runs back or
        jumps is read as it comes, as if nothing had come before, and so is one that has fixed its
        gains: an experiment that chooses them for a sampled loop must have that loop.
        """
        waiting, playout = self.waiting, self.playout
        age = touch.arrived - touch.t_client
        follows = waiting and touch.who.fixed_gains is None
        if not (follows and touch.t_client > waiting[-1].t_client and playout.fits(age)):
            waiting, playout = (), Playout.begun(age)
        return Samples((*waiting, touch)[-_LARGEST:], playout, self.read_at)

    def of(self, who: Participant) -> Samples:
        """Return the samples as of a participant that has changed its law or its gains."""
        waiting = [replace(one, who=who) for one in self.waiting]
        return Samples(tuple(waiting), self.playout, self.read_at)

    def read(self, now: float) -> tuple[Samples, Touch]:
        """Return the samples after a tick, and what the hand does at the playing time.

        Args:
            now: Time of the tick on the server's clock [s].

        Raises:
            IndexError: No sample has come.
        """
        newest, playout = self.waiting[-1], self.playout
        if now - newest.arrived <= LONGEST:  # a longer silence says nothing of the link
            playout = playout.measured(now - newest.t_client, now)
        dt = min(LONGEST, max(0.0, now - self.read_at))
        playout = playout.advanced(dt, now - newest.t_client)
        playing = now - playout.behind
        first = len(self.waiting) - 1
        while first > 0 and self.waiting[first].t_client > playing + _AS_GOOD:
            first -= 1
        waiting = self.waiting[first:]
        samples = Samples(waiting, playout, now)
        if len(waiting) == 1 or playing <= waiting[0].t_client + _AS_GOOD:
            return samples, waiting[0]
        return samples, between(waiting[0], waiting[1], playing, newest)


def between(a: Touch, b: Touch, at: float, newest: Touch) -> Touch:
    """Return what a hand does between two of its samples.

    Args:
        a, b: The samples, one after the other.
        at: Time on the client's clock, between theirs [s].
        newest: Newest sample, whose participant counts.
    """
    fraction = (at - a.t_client) / (b.t_client - a.t_client)
    reported = b if fraction >= _NEWER else a
    return replace(
        newest,
        probe=lerp(a.probe, b.probe, fraction),
        force=lerp(a.force, b.force, fraction),
        seq=reported.seq,
        tick=reported.tick,
        t_client=at,
        arrived=a.arrived + fraction * (b.arrived - a.arrived),
        anchor=_anchor(a.anchor, b.anchor, fraction),
        deflection=a.deflection
        if a.deflection is None or b.deflection is None
        else a.deflection + fraction * (b.deflection - a.deflection),
    )


def _anchor(a: Vec3 | None, b: Vec3 | None, fraction: float) -> Vec3 | None:
    return a if a is None or b is None else lerp(a, b, fraction)
