"""When to send a sample, so that it reaches the server just before the tick that uses it.

The server reports how long each sample waited for its tick. Together with the time at which the
sample was sent, this gives the right phase on the client's own clock. A schedule that moves towards
that phase locks to the server's ticks at any delay, and a force that it sends is on average half a
tick younger than a force sent at an unlucky phase. (Moving by a share of the wait alone would be an
integrator in a loop with the network's delay, which oscillates when that delay is long.)
"""

from __future__ import annotations

from typing import NamedTuple

TARGET_WAIT = 0.002  # s; margin for the jitter of two schedulers
GAIN = 0.1  # share of the error that one report corrects


class Pacer(NamedTuple):
    """Schedule of a client's samples.

    Args:
        period: Time between samples, the simulation period [s].
        due: Time at which the next sample is to be sent [s].
    """

    period: float
    due: float

    def sent(self, now: float) -> Pacer:
        """Schedule after a sample was sent at `now`; skips missed samples and keeps the phase."""
        missed = max(0, int((now - self.due) / self.period))
        return Pacer(self.period, self.due + (missed + 1) * self.period)

    def reported(self, sent_at: float, sample_wait: float) -> Pacer:
        """Schedule after the server has reported how long a sample waited for its tick.

        Args:
            sent_at: Time at which that sample was sent, on the clock of `due` [s].
            sample_wait: Time that the sample waited at the server [s].
        """
        right = sent_at + sample_wait - min(TARGET_WAIT, 0.5 * self.period)
        # Move earlier or later, whichever is nearer: only the phase matters, modulo the period.
        error = right - self.due
        error = (error + 0.5 * self.period) % self.period - 0.5 * self.period
        return Pacer(self.period, self.due + GAIN * error)
