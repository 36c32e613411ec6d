"""The loop delay of one client, as a recent maximum of measurements, so that gains do not chatter.

How far it is from a delay that glides says how steady the loop is.

A sample names the tick of the patch with which it was made; the server receives the sample some
simulation periods later. That number of periods is d + 1 of science 3.1. The number includes the
delays of network and schedulers, and the server needs no common clock to count it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from cohaptic.control.playout import FALL, RISE

# s; a measured delay counts for at least one window and at most two: long enough to see the rare
# late messages of a network, short enough that gains recover within a few presses. Reasoned, not
# measured.
WINDOW = 4.0
# s over which the distance of a delay from one that glides is averaged: rare pauses are forgotten.
# `wishes.STEADY` was found with it.
STEADY_TIME = 4.0
_STEADY = 1e-8  # s2; less is none, that is 0.1 ms rms, well below a tick. Reasoned, not measured.
# s; who was away for longer is not waited for longer: so much is forgotten to `wishes.STEADY`
# within 14 s. Reasoned, not measured.
_FARTHEST = 0.5
# s, assumed before the first measurement: longer than nearly every real loop. Reasoned, not
# measured.
UNKNOWN = 1.0
# s; a longer delay means that the client names wrong ticks: five times `TOO_LONG`. Reasoned, not
# measured.
LONGEST = 10.0
# Longest loop delay of a client that may take part [s]: 400 ms of jitter on top of 250 ms each way,
# and as much again. The room's lag grows with its slowest loop, so a slower client may only watch.
TOO_LONG = 2.0


@dataclass(frozen=True, slots=True)
class LoopDelay:
    """The largest loop delay of one client in the last one to two windows of `WINDOW` seconds.

    Args:
        recent: Largest delay in the present window [s]; negative before the first measurement.
        before: Largest delay in the previous window [s]; negative without such a window.
        until: End of the present window [s].
        unanswered: Time for which the client has pressed without naming the tick of a patch [s].
        glided: Delay as it is where playing runs a little faster or slower [s].
        unsteady: Mean square of the distance from that in the last `STEADY_TIME` [s2]. A long pause
            counts for more than several short ones of the same sum.
    """

    recent: float = -1.0
    before: float = -1.0
    until: float = 0.0
    unanswered: float = 0.0
    glided: float = 0.0
    unsteady: float = 0.0

    @property
    def value(self) -> float:
        """Loop delay for which to choose gains; `UNKNOWN` before the first measurement [s]."""
        # A comparison is quicker than `max`; the server reads this for every user in every tick.
        largest = self.recent if self.recent > self.before else self.before
        return largest if largest >= 0.0 else UNKNOWN

    @property
    def counted(self) -> float:
        """Loop delay for which to choose the room's lag, at most `TOO_LONG` [s].

        Gains concern this client alone, so `value` assumes a long delay until one is measured. The
        lag concerns the whole room, which should not wait for a client that answers no patch,
        either because no patch has come yet or because the client reads none: until the first
        measurement this delay is 0. `too_long` excludes such a client.
        """
        return min(TOO_LONG, max(0.0, self.recent, self.before))

    @property
    def too_long(self) -> bool:
        """Whether the loop is too slow for this client to take part.

        A client that has pressed for longer than `UNKNOWN` without naming a tick counts as too
        slow. Its user loses nothing, since a hand feels no surface before the first patch.
        """
        late = self.recent > TOO_LONG or self.before > TOO_LONG
        return late or self.unanswered > UNKNOWN

    def waited(self, period: float) -> LoopDelay:
        """Return the state after one more tick in which the client pressed without naming a tick.

        Args:
            period: Period of the simulation [s].
        """
        return replace(self, unanswered=self.unanswered + period)

    def unheard(self, delay: float, dt: float) -> LoopDelay:
        """Return the state after a tick in which the client counted as silent.

        Nothing is known of its delay then, but its loop is not steady.

        Args:
            delay: Age of the patch that its newest sample names [s].
            dt: Time since the tick before [s].
        """
        if self.recent < 0.0 and self.before < 0.0:
            return self
        glided, unsteady = self._glided(min(max(delay, 0.0), LONGEST), dt)
        return replace(self, glided=glided, unsteady=unsteady)

    def _glided(self, delay: float, dt: float) -> tuple[float, float]:
        """Return `glided` and `unsteady` after a time [s] at whose end the delay is this [s]."""
        if self.recent < 0.0 and self.before < 0.0:
            return delay, 0.0
        glided = self.glided
        glided += max(-2.0 * FALL * dt, min(RISE * dt, delay - glided))
        off = min(_FARTHEST, abs(delay - glided))
        unsteady = self.unsteady
        unsteady += min(1.0, dt / STEADY_TIME) * (off * off - unsteady)
        return glided, unsteady if unsteady >= _STEADY else 0.0

    def measured(self, delay: float, now: float, dt: float = 0.0) -> LoopDelay:
        """Return the state after one more measurement of the loop delay.

        Args:
            delay: Loop delay of one sample [s]; clipped to the range 0 to `LONGEST`.
            now: Time of the measurement [s].
            dt: Time since the tick before [s].
        """
        delay = min(max(delay, 0.0), LONGEST)
        if delay == self.glided <= self.recent and now < self.until and not self.unanswered:
            if self.unsteady <= 0.0:
                return self
        glided, unsteady = self._glided(delay, dt)
        if now < self.until:
            largest = max(self.recent, delay)
            return LoopDelay(largest, self.before, self.until, 0.0, glided, unsteady)
        return LoopDelay(delay, self.recent, now + WINDOW, 0.0, glided, unsteady)
