"""Latency injected between one user and the server, both ways, as if the network path were longer.

Messages pass through two delay lines that keep their order like a stream
(`cohaptic.simulated.delay_line`): when the delay becomes shorter, no message overtakes an earlier
one. This module does not sleep; the shell asks which messages are due, and when to ask again.

Watchers may inject latency if the server allows it, and all watchers are told the latency.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from cohaptic.errors import ProtocolError, RemoteProtocolError, SettingError
from cohaptic.protocol.watch_messages import (
    MAX_INJECTED_DELAY,
    MAX_INJECTED_JITTER,
    MAX_INJECTED_TAIL,
    Latency,
    SetLatency,
)
from cohaptic.simulated.delay_line import AT_ONCE, DelayLine, LinkSettings
from cohaptic.simulated.networks import read_network
from cohaptic_server.access.keys import forbidden
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.watch.watcher import Watcher

Data = str | bytes


class UserLatency:
    """Delay lines of one user's messages, one line for each direction.

    Args:
        seed: Seed of the random draws.
    """

    def __init__(self, seed: int) -> None:
        self.link = AT_ONCE
        self._up: DelayLine[Data] = DelayLine(LinkSettings(seed=2 * seed))
        self._down: DelayLine[Data] = DelayLine(LinkSettings(seed=2 * seed + 1))

    def set(self, link: LinkSettings) -> None:
        """Set the link of later messages, each way; messages in flight keep their delay."""
        self.link = link
        for line in (self._up, self._down):
            line.settings = replace(link, seed=line.settings.seed)

    @property
    def gone(self) -> bool:
        """Whether the link takes no time and no message is in flight."""
        return self.link.at_once and not self._up and not self._down

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


def link_of(change: SetLatency) -> LinkSettings:
    """Return the link that a watcher asks for.

    Raises:
        RemoteProtocolError: Its words for a network make no link, or one that is too slow.
    """
    try:
        link = read_network(change.network)
    except SettingError as error:
        raise RemoteProtocolError(error.name, error.value, error.limit) from None
    delay = link.delay if change.delay is None else change.delay
    jitter = link.jitter if change.jitter is None else change.jitter
    for name, value, limit in (
        ("delay", delay, MAX_INJECTED_DELAY),
        ("jitter", jitter, MAX_INJECTED_JITTER),
        ("tail", link.tail, MAX_INJECTED_TAIL),
        ("stall", link.stall, MAX_INJECTED_DELAY),
    ):
        if value > limit:
            raise RemoteProtocolError(
                f"{name} of a network", f"{value:g} s", f"at most {limit:g} s"
            )
    return replace(link, delay=delay, jitter=jitter)


def set_latency(
    peers: Iterable[Peer], watchers: Iterable[Watcher], change: SetLatency, outcome: Outcome
) -> None:
    """Set the injected latency of one user, and tell the watchers.

    Args:
        peers: Peers of the room.
        watchers: Watchers of the room.
        change: Number of the user, with the new link.
        outcome: Receives the peer whose latency has changed.

    Raises:
        RemoteProtocolError: The link is none.
    """
    link = link_of(change)
    for other in peers:
        if other.user == change.user and (other.latency, other.network) != (link, change.network):
            other.latency, other.network = link, change.network
            outcome.delayed.append(other)
            news = _news(change.user, other)
            for watcher in watchers:
                watcher.tell_latency(news)


def latencies(peers: Iterable[Peer]) -> Iterator[Latency]:
    """Iterate over the latencies of all users whose link takes time."""
    for peer in peers:
        if peer.user is not None and not peer.latency.at_once:
            yield _news(peer.user, peer)


def _news(user: int, peer: Peer) -> Latency:
    link = peer.latency
    return Latency(user=user, delay=link.delay, jitter=link.jitter, network=peer.network)
