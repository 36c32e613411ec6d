"""When to send: so that a sample reaches the server just before the tick that uses it.

The server reports how long each sample waited for its tick. With the moment at which that sample
was sent this gives the phase that would have been right, in the client's own time: a schedule that
moves towards it locks to the server's ticks whatever the delay between them, and its force is
younger by half a tick in the mean than one sent at an unlucky phase. (Moving by a share of the wait
alone would be an integrator in a loop with the network's delay, which swings when that is long.)
"""

from __future__ import annotations

from typing import NamedTuple

TARGET_WAIT = 0.002  # s; room for the jitter of two schedulers
GAIN = 0.1  # share of the error that one report corrects


class Pacer(NamedTuple):
    """Schedule of a client's samples.

    Args:
        period: Between samples, N T [s].
        due: When the next sample is to be sent [s].
    """

    period: float
    due: float

    def sent(self, now: float) -> Pacer:
        """A sample was sent at `now`; missed ones are left out, the phase is kept."""
        missed = max(0, int((now - self.due) / self.period))
        return Pacer(self.period, self.due + (missed + 1) * self.period)

    def reported(self, sent_at: float, sample_wait: float) -> Pacer:
        """The server reports how long a sample waited for its tick.

        Args:
            sent_at: When that sample was sent, on the clock of `due` [s].
            sample_wait: How long it waited [s].
        """
        right = sent_at + sample_wait - min(TARGET_WAIT, 0.5 * self.period)
        # Earlier or later, whichever is nearer: the phase counts, not the period.
        error = right - self.due
        error = (error + 0.5 * self.period) % self.period - 0.5 * self.period
        return Pacer(self.period, self.due + GAIN * error)
