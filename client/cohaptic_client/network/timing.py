"""Timing of a link: its round trip, jitter and clock offset, and the schedule of samples.

Every patch renews the estimates. As in NTP, a patch returns the time at which its sample left
(`t_client`), the time that the sample waited for the tick (`sample_wait`) and the time of the tick
(`t_server`). The clock offset is taken from the shortest recent round trip, which has spent the
least time in queues. Half of that round trip bounds the error, even if the delays of the two
directions differ.

A sample is sent so that it reaches the server just before the tick that uses it. The server reports
how long each sample waited for its tick. Together with the time at which the sample was sent, this
gives the right phase on the client's own clock. A schedule that moves towards that phase locks to
the server's ticks at any delay, and a force that it sends is on average half a tick younger than a
force sent at an unlucky phase. (Moving by a fraction of the wait alone would be an integrator in a
loop with the network's delay, which oscillates when that delay is long.)
"""

from __future__ import annotations

from typing import NamedTuple

WINDOW = 5.0  # s; the shortest round trip is used for at least this time and at most twice it
SMOOTHING = 0.05  # weight of a new round trip in the running means


class Passage(NamedTuple):
    """One measured round trip, from a sample to the patch that answers it.

    Args:
        round_trip: Duration of the round trip without the sample's wait at the server [s].
        offset: Server's clock less the client's, if both directions took equally long [s].
    """

    round_trip: float
    offset: float


class LinkTiming(NamedTuple):
    """Estimates of the round trip, jitter and clock offset of a link.

    Args:
        round_trip: Running mean of the round trip [s]; 0 before the first patch.
        jitter: Running mean of the deviation from `round_trip` [s].
        shortest: Shortest round trip of the present window of `WINDOW` [s]; None before the first
            patch.
        shortest_before: Shortest round trip of the window before; None in the first window.
        until: End of the present window, on the client's clock [s].
    """

    round_trip: float = 0.0
    jitter: float = 0.0
    shortest: Passage | None = None
    shortest_before: Passage | None = None
    until: float = 0.0

    @property
    def best(self) -> Passage | None:
        """Shortest recent round trip, for the clock offset; None before the first patch."""
        known = [p for p in (self.shortest, self.shortest_before) if p is not None]
        return min(known, key=lambda p: p.round_trip, default=None)

    @property
    def clock_offset(self) -> float:
        """Server's clock less the client's [s]; 0 before the first patch."""
        return self.best.offset if self.best else 0.0

    @property
    def clock_error(self) -> float:
        """Bound on the error of `clock_offset` [s]; 0 before the first patch."""
        return 0.5 * self.best.round_trip if self.best else 0.0

    def measured(
        self, *, t_client: float, t_server: float, sample_wait: float, now: float
    ) -> LinkTiming:
        """Return the estimates after one more patch.

        Args:
            t_client: Time at which the sample left, on the client's clock [s].
            t_server: Time of the tick, on the server's clock [s].
            sample_wait: Time that the sample waited for the tick [s].
            now: Time at which the patch came, on the client's clock [s].
        """
        trip = max(0.0, now - t_client - sample_wait)
        arrived = t_server - sample_wait
        passage = Passage(trip, 0.5 * ((arrived - t_client) + (t_server - now)))
        if self.shortest is None:
            return LinkTiming(trip, 0.0, passage, None, now + WINDOW)
        mean = self.round_trip + SMOOTHING * (trip - self.round_trip)
        jitter = self.jitter + SMOOTHING * (abs(trip - mean) - self.jitter)
        if now >= self.until:
            return LinkTiming(mean, jitter, passage, self.shortest, now + WINDOW)
        shortest = passage if trip < self.shortest.round_trip else self.shortest
        return LinkTiming(mean, jitter, shortest, self.shortest_before, self.until)


TARGET_WAIT = 0.002  # s; margin for the jitter of two schedulers
GAIN = 0.1  # fraction of the error that one report corrects


class Pacer(NamedTuple):
    """Schedule by which a client sends its samples.

    Args:
        period: Time between samples, the simulation period [s].
        due: Time at which the next sample is to be sent [s].
    """

    period: float
    due: float

    def sent(self, now: float) -> Pacer:
        """Return the schedule after a sample was sent at time `now` [s].

        The schedule skips samples that are overdue, and keeps its phase.
        """
        missed = max(0, int((now - self.due) / self.period))
        return Pacer(self.period, self.due + (missed + 1) * self.period)

    def reported(self, sent_at: float, sample_wait: float) -> Pacer:
        """Return the schedule after the server has reported how long a sample waited for its tick.

        Args:
            sent_at: Time at which that sample was sent, on the clock of `due` [s].
            sample_wait: Time that the sample waited at the server [s].
        """
        right = sent_at + sample_wait - min(TARGET_WAIT, 0.5 * self.period)
        # Move earlier or later, whichever is nearer: only the phase matters, modulo the period.
        error = right - self.due
        error = (error + 0.5 * self.period) % self.period - 0.5 * self.period
        return Pacer(self.period, self.due + GAIN * error)
