"""Recordings of a virtual session, one value per millisecond: probes, proxies, forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cohaptic.simulated.hand import Intention
from cohaptic_experiments.outcome import Progress
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession, VirtualUser
from cohaptic_server.numeric import Floats


@dataclass(frozen=True, eq=False)
class Trace:
    """Recording of one user, one value per haptic period.

    Depths are measured from the resting surface, in the direction in which the hand presses.

    Args:
        t: Time since the recording began, shape (n,) [s].
        probe: Depth of x_h, shape (n,) [m].
        proxy: Depth of x_o, of the surface as the simulation has it, shape (n,) [m].
        force: On the hand, shape (n,) [N].
        felt: Part of it that is there because others touch, shape (n,) [N].
        intended: Depth that the hand wants, shape (n,) [m].
        every: Haptic periods per simulation tick.
    """

    t: Floats
    probe: Floats
    proxy: Floats
    force: Floats
    felt: Floats
    intended: Floats
    every: int

    def last(self, seconds: float) -> slice:
        """The end of the recording."""
        return slice(-round(seconds / PERIOD), None)

    def per_tick(self) -> Floats:
        """Depth of x_o after each tick, shape (ticks,) [m]."""
        return np.asarray(self.proxy[self.every - 1 :: self.every])


def record(
    session: VirtualSession,
    presses: Mapping[str, Intention],
    seconds: float,
    progress: Progress,
) -> dict[str, Trace]:
    """Run the session and record the users named in `presses`.

    Args:
        session: To be run.
        presses: Intentions by the names of the users to record.
        seconds: Duration [s].
        progress: Called with the share that is done.
    """
    n = round(seconds / PERIOD)
    begin = session.now
    table: dict[str, Floats] = {name: np.empty((n, 5)) for name in presses}
    for k in range(n):
        session.run(PERIOD)
        for name, press in presses.items():
            user = session.users[name]
            probe = _depth(press, np.array(user.state.probe))
            proxy = _proxy(session, user, press)
            # A script's time begins with the first period.
            intended = _depth(press, np.array(press.position(session.now - begin - PERIOD)))
            table[name][k] = (probe, proxy, user.force[-1], user.felt[-1], intended)
        if k % 500 == 0:
            progress(k / n)
    every = round(session.room.settings.simulation_period / PERIOD)
    t = np.asarray(PERIOD * np.arange(n), dtype=np.float64)
    return {
        name: Trace(t, rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4], every)
        for name, rows in table.items()
    }


def _proxy(session: VirtualSession, user: VirtualUser, press: Intention) -> float:
    """Depth of x_o under one user; 0 before its first contact [m]."""
    world = session.room.world
    state = world.users.get(user.number)
    if state is None or world.response is None:
        return 0.0
    contact = state.contact
    return _depth(press, contact.moved(world.response.displacement)) - _depth(press, contact.point)


def _depth(press: Intention, x: Floats) -> float:
    """Depth of a point below the resting surface, in the direction of a press [m]."""
    return float((x - np.array(press.surface)) @ np.array(press.direction))
