"""Session files of the real parts: hands on a body in virtual time, with rows and scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic import __version__
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.sessions.entries import (
    Happened,
    Mark,
    Rows,
    SessionInfo,
    Written,
)
from cohaptic.sessions.writer import SessionFile
from cohaptic.simulated.hand import HandScript, Rhythm
from cohaptic.status.row import COLUMNS
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.room.body_frames import describe
from session_file import Hand, Noted

STEP = 0.1  # s of rows in one block
TO_WALL = 1.8e9  # s


class _Noted:
    """A session in virtual time whose entries are noted."""

    def __init__(self, body: Body, *, surfaces: bool) -> None:
        self.session, self.found = VirtualSession(body), list[Written]()
        self.session.keep_in(Noted(self.found), surfaces=surfaces)
        self._hands: dict[str, Hand] = {}

    def join(self, name: str, angle: float) -> None:
        script = HandScript(angle=angle, depth=0.015, rhythm=Rhythm(2.0), approach_at=0.1)
        user = self.session.join(name, script, delay=0.02, seed=len(self._hands))
        self._hands[name] = Hand(user, self.session, np.random.default_rng(1))
        self._hands[name].watch()

    def leave(self, name: str) -> None:
        del self._hands[name]
        self.session.drop(name)

    def run(self) -> None:
        self.session.run(STEP)
        for hand in self._hands.values():
            block = np.array(hand.rows)
            hand.rows.clear()
            t, number = float(block[0, 0]), hand.user.number
            self.found.append(Rows(t, number, COLUMNS, block.tobytes(), 0.0, 1e-4))


def entries(
    seconds: float,
    body: Body | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    surfaces: bool = False,
) -> tuple[SessionInfo, list[Written]]:
    """A session of Ann and Ben, who press in turn; Ben leaves after three quarters of it.

    Args:
        seconds: Its length [s].
        body: Body that they press; None for the balloon.
        settings: As in the first entry of the file.
        surfaces: Whether every fourth scene has its surface, from the first on.

    Returns:
        The first entry, and all others in the order of their times.
    """
    noted = _Noted(body or Balloon(), surfaces=surfaces)
    session, found = noted.session, noted.found
    info = SessionInfo(
        session.now, __version__, PROTOCOL_VERSION, "lab",
        describe(session.room.body).model_dump(mode="json"),
        session.room.settings.simulation_period, TO_WALL, settings or {"body": "balloon"},
    )  # fmt: skip
    noted.join("Ann", 0.0)
    for step in range(round(seconds / STEP)):
        share = step * STEP / seconds
        if math.isclose(share, 0.25):
            noted.join("Ben", 0.9)
        if math.isclose(share, 0.5):
            found.append(Mark(session.now, "trial 1", {"load": "soft"}, by=1))
        if math.isclose(share, 0.6):
            found.append(Happened(session.now, "fault", 2, "Ben's device was away for a moment"))
        if math.isclose(share, 0.75):
            noted.leave("Ben")
        noted.run()
    return info, found


def write(path: Path, info: SessionInfo, found: list[Written]) -> Path:
    """Write a closed file of a session, and return its path."""
    file = SessionFile("--record", path, info)
    for entry in found:
        file.add(entry)
    file.close()
    return path


def record(path: Path, seconds: float = 4.0, **more: Any) -> Path:
    """Record a session of `entries` to a file."""
    return write(path, *entries(seconds, **more))
