"""Latency injected between one user and the server, both ways, as if the network path were longer.

Messages pass through two delay lines that keep their order like a stream
(`cohaptic.simulated.delay_line`): when the delay becomes shorter, no message overtakes an earlier
one. This module does not sleep; the shell asks which messages are due, and when to ask again.

Watchers may inject latency if the server allows it, and all watchers are told the latency.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from cohaptic.errors import ProtocolError, RemoteProtocolError
from cohaptic.protocol.watch_messages import Latency, SetLatency
from cohaptic.simulated.delay_line import DelayLine, LinkSettings
from cohaptic_server.access.keys import forbidden
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.watch.watcher import Watcher

Data = str | bytes


class UserLatency:
    """Delay lines of one user's messages, one line for each direction.

    Args:
        seed: Seed of the random jitter.
    """

    def __init__(self, seed: int) -> None:
        self.delay = self.jitter = 0.0
        self._up: DelayLine[Data] = DelayLine(LinkSettings(seed=2 * seed))
        self._down: DelayLine[Data] = DelayLine(LinkSettings(seed=2 * seed + 1))

    def set(self, delay: float, jitter: float) -> None:
        """Set delay and jitter of later messages, each way [s]; messages in flight keep theirs."""
        self.delay, self.jitter = delay, jitter
        for line in (self._up, self._down):
            line.settings = replace(line.settings, delay=delay, jitter=jitter)

    @property
    def gone(self) -> bool:
        """Whether delay and jitter are zero and no message is in flight."""
        return self.delay == self.jitter == 0.0 and not self._up and not self._down

    def push_up(self, data: Data, now: float) -> None:
        """Accept a message from the user; raise LinkOverflow if too many are in flight."""
        self._up.push(data, now)

    def push_down(self, data: Data, now: float) -> None:
        """Accept a message to the user; raise LinkOverflow if too many are in flight."""
        self._down.push(data, now)

    def due_up(self, now: float) -> list[Data]:
        """Return the messages from the user that are due by `now`, in order."""
        return self._up.pop_due(now)

    def due_down(self, now: float) -> list[Data]:
        """Return the messages to the user that are due by `now`, in order."""
        return self._down.pop_due(now)

    def next_due(self) -> float | None:
        """Return the time at which the next message is due [s]; None when none is in flight."""
        times = [due for due in (self._up.next_due(), self._down.next_due()) if due is not None]
        return min(times, default=None)


def refusal(peer: Peer, *, allowed: bool) -> ProtocolError | None:
    """Return the reason why a watcher may not inject latency; None if the watcher may.

    Args:
        peer: Watcher that asks for a latency.
        allowed: Whether the server allows injected latency at all.
    """
    if not allowed:
        limit = "none: start the server with --allow-latency to inject latency"
        return RemoteProtocolError("message", "SetLatency", limit)
    if not peer.guest.grants.can_inject_latency:
        words = "the token does not let you inject latency (canInjectLatency)"
        return forbidden(words)
    return None


def set_latency(
    peers: Iterable[Peer], watchers: Iterable[Watcher], change: SetLatency, outcome: Outcome
) -> None:
    """Set the injected latency of one user, and tell the watchers.

    Args:
        peers: Peers of the room.
        watchers: Watchers of the room.
        change: Number of the user, with the new delay and jitter [s].
        outcome: Receives the peer whose latency has changed.
    """
    latency = (change.delay, change.jitter)
    for other in peers:
        if other.user == change.user and other.latency != latency:
            other.latency = latency
            outcome.delayed.append(other)
            news = Latency(user=change.user, delay=change.delay, jitter=change.jitter)
            for watcher in watchers:
                watcher.tell_latency(news)


def latencies(peers: Iterable[Peer]) -> Iterator[Latency]:
    """Iterate over the latencies of all users whose delay or jitter is not zero."""
    for peer in peers:
        delay, jitter = peer.latency
        if peer.user is not None and (delay, jitter) != (0.0, 0.0):
            yield Latency(user=peer.user, delay=delay, jitter=jitter)
