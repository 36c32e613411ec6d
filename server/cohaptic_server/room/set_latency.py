"""The latency that watchers inject between users and the server: who may, and who hears of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from cohaptic.errors import ProtocolError, RemoteProtocolError
from cohaptic.protocol.watch_messages import Latency, SetLatency
from cohaptic_server.access.denied import forbidden
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.watch.watcher import Watcher


def refusal(peer: Peer, *, allowed: bool) -> ProtocolError | None:
    """Why a watcher may not inject latency; None if it may.

    Args:
        peer: Who watches.
        allowed: Whether the server lets anybody.
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
    """Delay the messages of a user from now on, and tell who watches.

    Args:
        peers: Of the room.
        watchers: Of the room.
        change: What was asked for.
        outcome: To which the tasks of the shell are added.
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
    """Of all users who have some."""
    for peer in peers:
        delay, jitter = peer.latency
        if peer.user is not None and (delay, jitter) != (0.0, 0.0):
            yield Latency(user=peer.user, delay=delay, jitter=jitter)
