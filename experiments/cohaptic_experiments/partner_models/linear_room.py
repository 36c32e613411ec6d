"""Many linear rooms at once: hands that touch a linear body all the time, behind a network.

A fast stand-in for a session, for ensembles: contacts neither open nor move, and C is given. The
network, the clients' models and the sampling are those of the program.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.numeric import Floats
from cohaptic_server.world.partners.hand_estimate import (
    BANDS,
    STEP,
    WINDOW,
    Clouds,
    on_grid,
    seen,
)
from cohaptic_server.world.partners.small_gain import (
    FREQUENCIES,
    Surroundings,
    lag,
    lag_towards,
    surroundings,
    towards,
)

Numbers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Rooms:
    """R rooms of n hands.

    Args:
        hands: Shape (R, n, 3).
        C: Compliance between contacts, shape (R, n, n) [m/N].
        intentions: Shape (t, R, n) [m].
        delay: Delay between each user and the server, each way, shape (R, n) [s].
        jitter: Largest extra delay [s].
        tick: Period of the ticks [s].
        hands_before: The hands until `tense_at`; None if they are the same.
        tense_at: Time at which they change [s].
    """

    hands: Floats
    C: Floats
    intentions: Floats
    delay: Floats
    jitter: float = 0.0
    tick: float = 1.0 / 60.0
    hands_before: Floats | None = None
    tense_at: float = 0.0

    def hands_at(self, t: float) -> Floats:
        """Return the hands at a time [s], shape (R, n, 3)."""
        before = self.hands_before
        return before if before is not None and t < self.tense_at else self.hands


@dataclass(frozen=True, eq=False)
class Way:
    """How hands are modelled.

    Args:
        models: Models at the start, shape (R, n, 3) or (3,).
        lag: Lag of q at the start [s].
        estimates: Whether clouds follow the hands.
        lags: Whether the lag is chosen too; without, it stays.
        sensed: Resolution of the sensors [m].
        seed: Seed of the clouds, and of the jitter.
    """

    models: Floats
    lag: float = 0.0
    estimates: bool = False
    lags: bool = False
    sensed: float = 0.0
    seed: int = 0


@dataclass(eq=False)
class Played:
    """What was felt: forces (t, R, n) [N], and models, lags and spreads after each step."""

    force: Floats
    models: list[Floats] = field(default_factory=list[Floats])
    lags: list[Floats] = field(default_factory=list[Floats])
    spreads: list[Floats] = field(default_factory=list[Floats])


def truth(rooms: Rooms) -> Floats:
    """Return the forces of the same hands without a network, shape (t, R, n) [N]."""
    stiff = np.linalg.inv(rooms.C)
    x, v = rooms.intentions[0] * 0.0, rooms.intentions[0] * 0.0
    force = np.empty(rooms.intentions.shape)
    for t, i in enumerate(rooms.intentions):
        m, b, k = (rooms.hands_at(t * PERIOD)[..., a] for a in range(3))
        force[t] = f = np.einsum("rij,rj->ri", stiff, x)
        v = (v + PERIOD / m * (k * (i - x) - f)) / (1.0 + PERIOD * b / m)
        x = x + PERIOD * v
    return force


# Above 60 lines: one loop over time with a state that all parts share, kept fast.
def play(rooms: Rooms, way: Way) -> Played:
    """Play rooms."""
    steps, R, n = rooms.intentions.shape
    stiff = np.linalg.inv(rooms.C)
    x, v = np.zeros((R, n)), np.zeros((R, n))
    rng = np.random.default_rng(way.seed)
    sent_at, tick_of = _ticks(steps, rooms.tick)
    up, down = _newest(rooms, len(sent_at), steps, rng)
    own: Numbers = np.arange(n, dtype=np.int64)
    # State of the model of hand j in client i at [:, i, j]; its parameters, and those that i sends.
    y, yv = np.zeros((R, n, n)), np.zeros((R, n, n))
    models = np.broadcast_to(way.models, (R, n, 3)).copy()
    theirs = np.broadcast_to(models[:, None], (R, n, n, 3)).copy()
    lags, q = np.full((R, n), way.lag), np.zeros((R, n))
    wanted_models, wanted_lags = models, lags
    sent_q, sent_models = np.zeros((len(sent_at), R, n)), np.zeros((len(sent_at), R, n, 3))
    news, before, came = np.zeros((R, n, n)), np.zeros((R, n, n)), np.zeros((R, n))
    last = np.full((R, n), -1)
    rooms_: Numbers = np.arange(R, dtype=np.int64)[:, None, None]
    hands_: Numbers = own[None, None, :]
    clouds = Clouds.of(R * n, seed=way.seed) if way.estimates else None
    kept, step = round(WINDOW / rooms.tick) + 2, round(STEP / PERIOD)
    tips, pushes = list[Floats](), list[Floats]()
    played = Played(np.empty(rooms.intentions.shape))
    for t in range(steps):
        now = t * PERIOD
        m, b, k = (rooms.hands_at(now)[..., a] for a in range(3))
        # What has come: of the newest tick that reached this client, all q that had reached it.
        newest = down[t]
        if (fresh := newest > last).any():
            last = np.maximum(last, newest)
            index = up[np.maximum(last, 0)[..., None], rooms_, hands_]
            ok = (last[..., None] >= 0) & (index >= 0)
            came_q = np.where(ok, sent_q[np.maximum(index, 0), rooms_, hands_], 0.0)
            before = np.where(fresh[..., None], news, before)
            news = np.where(fresh[..., None], came_q, news)
            came = np.where(fresh, now, came)
            reported = sent_models[np.maximum(index, 0), rooms_, hands_]
            theirs = np.where((ok & fresh[..., None])[..., None], reported, theirs)
        theirs[:, own, own] = models
        fraction = np.minimum(1.0, (now - came + PERIOD) / rooms.tick)[..., None]
        depth = before + fraction * (news - before) - y
        sensed = np.round(x / way.sensed) * way.sensed if way.sensed else x
        depth[:, own, own] = sensed
        # The force of this period moves tip and model in the next one: x and y of the same instant.
        wanted = sensed + y[:, own, own]
        F = depth @ stiff
        yv = (yv + PERIOD / theirs[..., 0] * (F - theirs[..., 2] * y)) / (
            1.0 + PERIOD * theirs[..., 1] / theirs[..., 0]
        )
        y = y + PERIOD * yv
        f = F[:, own, own]
        played.force[t] = f
        q = q + (wanted - q) * (PERIOD / (PERIOD + lags))
        if (tick := tick_of[t]) >= 0:
            models = towards(models, wanted_models, wanted_lags > lags, rooms.tick)
            lags = lag_towards(lags, wanted_lags, rooms.tick)
            sent_q[tick], sent_models[tick] = q, models
            tips, pushes = [*tips, sensed.ravel()][-kept:], [*pushes, f.ravel()][-kept:]
        v = (v + PERIOD / m * (k * (rooms.intentions[t] - x) - f)) / (1.0 + PERIOD * b / m)
        x = x + PERIOD * v
        if clouds is None:
            continue
        if (t + 1) % step == 0 and now > WINDOW + rooms.tick:
            around = surroundings(rooms.C, models, BANDS)
            times = rooms.tick * np.arange(len(tips), dtype=np.float64)
            window = seen(on_grid(times, np.array(tips)), on_grid(times, np.array(pushes)))
            clouds = clouds.after(window, (1.0 / around.compliance).reshape(R * n, -1))
            wanted_models, wanted_lags = _chosen(rooms.C, clouds, models, lags, way)
            played.models.append(models)
            played.lags.append(lags)
            played.spreads.append(clouds.spread.reshape(R, n, 3))
    return played


def _chosen(
    C: Floats, clouds: Clouds, models: Floats, lags: Floats, way: Way
) -> tuple[Floats, Floats]:
    R, n, _ = models.shape
    wanted = clouds.mean.reshape(R, n, 3)
    if not way.lags:
        return wanted, lags
    around = surroundings(C, models, FREQUENCIES)
    each = Surroundings(around.compliance.reshape(R * n, -1), around.fraction.reshape(R * n, -1))
    return wanted, lag(each, clouds.hands[:, ::2], models.reshape(R * n, 3)).reshape(R, n)


def _ticks(steps: int, tick: float) -> tuple[Floats, Numbers]:
    """Return the time of each tick, and the tick at each step; -1 for none."""
    number = np.floor(np.arange(steps) * PERIOD / tick + 1e-6).astype(np.int64)
    first = np.diff(number, prepend=-1) > 0
    at = np.asarray(np.flatnonzero(first) * PERIOD, dtype=np.float64)
    return at, np.where(first, number, -1).astype(np.int64)


def _newest(
    rooms: Rooms, ticks: int, steps: int, rng: np.random.Generator
) -> tuple[Numbers, Numbers]:
    """Return the newest sample at each tick (ticks, R, n), and tick at each step (steps, R, n)."""
    R, n = rooms.delay.shape
    at = np.arange(ticks)[:, None, None] * rooms.tick
    clock = [np.arange(ticks) * rooms.tick, np.arange(steps) * PERIOD]
    found: list[Numbers] = []
    for times in clock:
        # A sample of a period is there in the next one at the earliest.
        drawn = at + 2.0 * PERIOD + rooms.delay + rooms.jitter * rng.random((ticks, R, n))
        arrives = np.maximum.accumulate(drawn, axis=0)  # messages stay in order
        index = np.empty((len(times), R, n), dtype=np.int64)
        for r in range(R):
            for i in range(n):
                index[:, r, i] = np.searchsorted(arrives[:, r, i], times + 1e-9, "right") - 1
        found.append(index)
    return found[0], found[1]
