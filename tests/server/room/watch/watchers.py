"""Watchers as the tests make and read them."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.protocol.messages import BodyInfo, Error, UserJoined
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import (
    EncodingName,
    Moderated,
    Watch,
    Watching,
    decode_watch_control,
)
from cohaptic_server.room.watch.watcher import Watcher

WATCHING = Watching(
    simulation_period=1 / 60,
    body=BodyInfo(name="balloon", center=(0.0, 0.0, 0.0), radius=0.1, contact_radius=0.02),
    model=None,
    users=(),
    allow_latency=True,
    allow_fixed_gains=False,
)


NEWS = UserJoined(user=2, name="right")
ANSWER = Moderated(action="freeze", user=None, done=True)


def watcher(
    encoding: EncodingName = "frames", rate: float = 60.0, *, has_model: bool = True
) -> Watcher:
    """One who was taken in and has read that."""
    watch = Watch(protocol=PROTOCOL_VERSION, encoding=encoding, rate=rate)
    made = Watcher(watch, has_model=has_model)
    made.accept(WATCHING)
    made.take(clear=True)
    return made


def ended(made: Watcher) -> tuple[int, Error]:
    assert made.close is not None
    last = [data for data in made.take(clear=True) if isinstance(data, str)][-1]
    error = decode_watch_control(last)
    assert isinstance(error, Error)
    assert error.code == made.close[0]
    return made.close[0], error


@dataclass(frozen=True)
class Sent:
    """A scene that went out."""

    tick: int
    version: int
    surface: bool
    at: float
