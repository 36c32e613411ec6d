"""When to play what comes over a link that wavers, so that its delay is constant (science 3.16).

A message says what was at the time at which it was sent. A receiver that used each one when it
comes would pass the jitter of the link on to a finger. So it plays messages by the times at which
they were sent, behind by the age of the newest one at the time at which it is needed: the age that
only one in a hundred exceeds (adaptive playout; Ramjee, Kurose, Towsley, Schulzrinne 1994). Clocks
need not agree, since the difference of two clocks is a part of that age. On a link that does not
waver this waits for nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

# Share of the times at which the newest message may be too old for the playing time. A quantile
# waits less than the largest age: one lost packet at a long round trip is ten times the jitter.
# docs/measured.md, "Links that waver", has what is felt with it.
FRACTION: Final = 0.01
# s; an age counts for at least one window and at most two, some 300 messages each: of so many the
# hundredth part is known to a half or so. Reasoned, not measured.
WINDOW: Final = 5.0
# s; duration of the first two windows, so that the first ages are soon forgotten: samples find
# their phase meanwhile, and their ages say nothing of the link. Reasoned, not measured.
BEGINNING: Final = 1.5
_KEPT: Final = 16  # largest ages of a window; the share of 1,600 messages
# s/s by which playing falls behind, and catches up: what moves at 4 Hz is felt at 3 to 5 Hz while a
# link gets worse or better, and after a pause.
RISE: Final = 0.25
FALL: Final = 0.25
# s over the least age of late; beyond, the link stalls, and what was missed is not worth a wait.
# Reasoned, not measured.
LONGEST: Final = 0.25
# s by which an age changes only if a clock was set or another peer sends: longer than any wait, and
# as long as a loop may be (`delay.TOO_LONG`). Reasoned, not measured.
ANOTHER: Final = 2.0


@dataclass(frozen=True, slots=True)
class Ages:
    """The largest ages of the newest message in the last one to two windows, and the least one.

    Args:
        recent: Largest ages in the present window, largest first, at most 16 of them [s].
        count: Number of ages in the present window.
        least: Least of them [s]; infinite without any.
        before, count_before, least_before: The same of the window before.
        until: End of the present window [s].
    """

    recent: tuple[float, ...] = ()
    count: int = 0
    least: float = math.inf
    before: tuple[float, ...] = ()
    count_before: int = 0
    least_before: float = math.inf
    until: float = -math.inf

    def measured(self, age: float, now: float) -> Ages:
        """Return the ages with one more [s], which was measured at time `now` [s]."""
        if now >= self.until:
            until = now + (WINDOW if self.before else BEGINNING)
            return Ages((age,), 1, age, self.recent, self.count, self.least, until)
        recent = self.recent
        if len(recent) < _KEPT or age > recent[-1]:
            recent = tuple(sorted((*recent, age), reverse=True)[:_KEPT])
        return Ages(
            recent, self.count + 1, min(self.least, age), self.before, self.count_before,
            self.least_before, self.until,
        )  # fmt: skip

    @property
    def lowest(self) -> float:
        """The smallest age of a message in the last one to two windows [s]; infinite before any."""
        return min(self.least, self.least_before)

    @property
    def largest(self) -> float:
        """The age that one in a hundred exceeds, or `LONGEST` over the least one [s].

        Raises:
            IndexError: There was no age yet.
        """
        ages = sorted((*self.recent, *self.before), reverse=True)
        beyond = int(FRACTION * (self.count + self.count_before))
        return min(ages[min(beyond, len(ages) - 1)], self.lowest + LONGEST)


@dataclass(frozen=True, slots=True)
class Playout:
    """The playing time of one sender's messages.

    Args:
        ages: Ages of the newest message of late.
        behind: Receiver's clock less the playing time [s].
        wanted: Value that `behind` glides to [s].
    """

    ages: Ages = Ages()
    behind: float = 0.0
    wanted: float = 0.0

    @staticmethod
    def begun(behind: float) -> Playout:
        """Return the playout of a first message: the receiver's clock less its time [s]."""
        return Playout(Ages(), behind, behind)

    @property
    def wavers(self) -> float:
        """What playing at constant time costs: `wanted` over the least age of late [s]."""
        return max(0.0, self.wanted - self.ages.lowest)

    def fits(self, age: float) -> bool:
        """Return whether a message that is so old when it comes [s] is of the same clock."""
        return abs(age - self.wanted) <= ANOTHER

    def measured(self, age: float, now: float) -> Playout:
        """Return the playout after the newest message was found to be so old.

        Args:
            age: Receiver's clock less the message's time, at the latest time at which the message
                is needed: when the next one comes, or when it is read [s].
            now: Time of the receiver's clock [s].
        """
        ages = self.ages.measured(age, now)
        return Playout(ages, self.behind, ages.largest)

    def advanced(self, dt: float, age: float) -> Playout:
        """Return the playout after a time: the playing time runs a little faster or slower.

        Where nothing newer has come it stands still, and goes on from there: a pause, and no jump.
        After a pause of more than `LONGEST`, or where the first message was later than that, it
        jumps on: what a hand did long ago is not felt any more.

        Args:
            dt: The time [s].
            age: Receiver's clock less the time of the newest message, at its end [s].
        """
        behind = self.behind + max(-FALL * dt, min(RISE * dt, self.wanted - self.behind))
        behind = min(max(behind, age), self.wanted + LONGEST)
        return self if behind == self.behind else Playout(self.ages, behind, self.wanted)


NOT_PLAYED: Final = Playout()
