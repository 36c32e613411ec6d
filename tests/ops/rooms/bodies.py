"""Bodies of rooms, made in their processes."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from cohaptic.clock import SystemClock
from cohaptic.errors import BodyError
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import Body, DenseResponse, Load, Response
from cohaptic_server.settings import ServerSettings

LONG = 0.03  # s of a core, however long it waits for one; almost two periods at 60 Hz
SMALL = BalloonSettings(subdivisions=2, contact_radius=0.03)
CLOCK = SystemClock()


def processor_time() -> float:
    """That this process has taken [s]."""
    assert sys.platform != "win32"
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


class SlowBalloon(Balloon):
    """One whose response in a tick takes `LONG`."""

    answered = 0.0

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        # The many responses before the first tick follow each other at once.
        if CLOCK.now() - self.answered > 5e-3:
            until = processor_time() + LONG
            while processor_time() < until:
                pass
        found = super().respond(loads, before)
        self.answered = CLOCK.now()
        return found


def small(_settings: ServerSettings) -> Body:
    return Balloon(SMALL)


def slow(_settings: ServerSettings) -> Body:
    return SlowBalloon(SMALL)


def torn(_settings: ServerSettings) -> Body:
    raise BodyError("the mesh is torn")
