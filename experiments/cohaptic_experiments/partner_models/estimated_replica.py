"""A scheme in which each client moves models of the other hands itself, and the network has wishes.

Each client moves a model of its own hand under the force that it gives, m y'' + b y' + k y = f, and
sends the give y with its tip. The server adds it to the hand's depth x: q = x + y is where the hand
would be without any force, if the model were right. A client gets the q of all hands, their models
and the compliance C between all contacts. At the haptic rate it moves a model of each other hand,
whose depth is q - y, and solves C f = x with its own depth in place. The models answer a press at
once, at any delay; only the wishes of the others come late (science 3.15).

A client estimates its own hand, and its model follows the estimate without a change of y: q stays
continuous at its source. The others change their copy when the message arrives that is made with
it, so that their depths stay continuous, too, and both copies settle alike. Tip and y are of the
same period: with y one period later, rooms near the bound grew.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.simulated.hand import Hand
from cohaptic.vec import ZERO, Vec3, dot, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_experiments.partner_models.hand_estimate import (
    BANDS,
    BLOCK,
    STEP,
    WINDOW,
    Clouds,
    seen,
)
from cohaptic_experiments.partner_models.small_gain import (
    FREQUENCIES,
    Surroundings,
    lag,
    lag_towards,
    surroundings,
    towards,
)
from cohaptic_experiments.transparency.frequency import Complex
from cohaptic_experiments.transparency.scheme import Arrived
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.world.at_once import TouchAtOnce
from cohaptic_server.world.equilibrium import complementarity


@dataclass(frozen=True, eq=False)
class Told:
    """What a client sends in a tick: its tip, and the give, model and lag of its own hand."""

    tip: Vec3
    give: float
    model: Floats
    lag: float


@dataclass(frozen=True, eq=False)
class News:
    """What the server sends to a client: the contacts, C, the q of all hands and their models."""

    point: Vec3
    normal: Vec3
    compliance: Floats
    intended: Floats
    models: Floats


@dataclass(frozen=True, slots=True)
class Estimation:
    """How models follow.

    Args:
        on: Whether they do.
        lagged: Whether the lag is chosen; without, it stays.
        lag: Lag at first [s].
    """

    on: bool = True
    lagged: bool = True
    lag: float = 0.04


class EstimatedReplica:
    """The scheme.

    Args:
        body: Touched body.
        users: Number of users.
        model: Hand that everybody is taken for at first.
        estimation: How models follow.
        hz: Ticks per second.
    """

    def __init__(
        self, body: Body, users: int, model: Hand, estimation: Estimation | None = None,
        hz: float = 60.0,
    ) -> None:  # fmt: skip
        self.period = 1.0 / hz
        self._touch, self._n = TouchAtOnce(body, users), users
        self._told: list[Told | None] = [None] * users
        self._intended: Floats | None = None
        estimation = estimation or Estimation()
        first = np.array(astuple(model))
        self.clients = [Client(u, users, first, self.period, estimation) for u in range(users)]

    def client(
        self, user: int, now: float, sample: DeviceSample, inbox: Sequence[News]
    ) -> tuple[Vec3, Told | None]:
        """Compute one period of a client."""
        return self.clients[user].step(now, sample.position, inbox)

    def server(
        self, now: float, inboxes: Mapping[int, Sequence[Arrived[Told]]]
    ) -> Mapping[int, News]:
        """Compute one tick: contacts, C, and where hands would be without their forces."""
        for user, came in inboxes.items():
            if came:
                self._told[user] = came[-1].message
        told = [one for one in self._told if one is not None]
        if len(told) < self._n:
            return {}
        self._touch.felt([one.tip for one in told])
        contacts = self._touch.contacts
        q = np.array(
            [
                c.normal @ (c.point - np.array(one.tip)) + one.give
                for c, one in zip(contacts, told, strict=True)
            ]
        )
        if self._intended is not None:
            kept = [0.0 if one.lag == 0.0 else math.exp(-self.period / one.lag) for one in told]
            q = q + np.array(kept) * (self._intended - q)
        self._intended = q
        models = np.array([one.model for one in told])
        return {
            user: News(vec3(c.point), vec3(c.normal), self._touch.compliance, q, models)
            for user, c in enumerate(contacts)
        }


class Client:
    """A client, with the estimate of its hand."""

    def __init__(
        self, user: int, n: int, model: Floats, period: float, estimation: Estimation
    ) -> None:
        self._user, self._period, self._how = user, period, estimation
        self.model, self.lag = model, estimation.lag
        self._wanted, self._wanted_lag = model, np.array([estimation.lag])
        self._models = np.tile(model, (n, 1))
        self._y, self._v = np.zeros(n), np.zeros(n)
        self._news: News | None = None
        self._before: News | None = None
        self._came, self._told = 0.0, -1.0
        self.estimate = Estimate(user) if estimation.on else None

    def want(self, model: Floats, lag_of_q: float) -> None:
        """Glide to a model, shape (3,), and a lag [s]."""
        self._wanted, self._wanted_lag = model, np.array([lag_of_q])

    def step(self, now: float, tip: Vec3, inbox: Sequence[News]) -> tuple[Vec3, Told | None]:
        """Compute one haptic period."""
        for news in inbox:
            self._before, self._news, self._came = self._news or news, news, now
            self._models = news.models.copy()
            self._models[self._user] = self.model
        # The force of this period moves tip and model in the next one: x and y of the same instant.
        give = float(self._y[self._user])
        push, force = ZERO, None
        if self._news is not None and self._before is not None:
            force, normal = self._force(now, tip, self._before, self._news)
            push = scale(normal, float(force[self._user]))
        if self.estimate is not None and force is not None and self._news is not None:
            self.estimate.add(tip, push, force)
            if self.estimate.due:
                self._choose(self._news)
        if now - self._told < self._period - 0.5 * PERIOD:
            return push, None
        self._told = now
        self.model = towards(self.model, self._wanted, self._period)
        self.lag = float(lag_towards(np.array([self.lag]), self._wanted_lag, self._period)[0])
        self._models[self._user] = self.model
        return push, Told(tip, give, self.model, self.lag)

    def _force(self, now: float, tip: Vec3, a: News, b: News) -> tuple[Floats, Vec3]:
        share = min(1.0, (now - self._came + PERIOD) / self._period)
        depth = a.intended + share * (b.intended - a.intended) - self._y
        old, new = (dot(n.normal, sub(n.point, tip)) for n in (a, b))
        depth[self._user] = old + share * (new - old)
        C = a.compliance + share * (b.compliance - a.compliance)
        force = complementarity(C, depth)
        m, damping, k = self._models.T
        self._v = self._v + PERIOD / m * (force - k * self._y)
        self._v /= 1.0 + PERIOD * damping / m
        self._y = self._y + PERIOD * self._v
        return force, b.normal

    def _choose(self, news: News) -> None:
        assert self.estimate is not None
        touching = self.estimate.touching | (np.arange(len(self._models)) == self._user)
        C, models = news.compliance[np.ix_(touching, touching)], self._models[touching]
        place = int(touching[: self._user].sum())
        around = surroundings(C, models, BANDS)
        self.estimate.take(1.0 / around.give[place])
        clouds = self.estimate.clouds
        around = surroundings(C, self._models[touching], FREQUENCIES)
        mine = Surroundings(around.give[place][None], around.share[place][None])
        wanted_lag = float(self._wanted_lag[0])
        if self._how.lagged:
            wanted_lag = float(lag(mine, clouds.hands[:, ::2], self.model[None])[0])
        self.want(clouds.mean[0], wanted_lag)


class Estimate:
    """Windows of one hand's tip and force, and its cloud."""

    def __init__(self, user: int) -> None:
        self.clouds = Clouds(1, seed=user)
        self._tips, self._pushes = list[Floats](), list[Floats]()
        self._sums, self._periods = np.zeros((2, 3)), 0
        self._felt: Floats | None = None
        self.due = False

    @property
    def touching(self) -> npt.NDArray[np.bool_]:
        """Whether each hand pressed at all since the last step, shape (n,)."""
        assert self._felt is not None
        return np.asarray(self._felt > 0.0)

    def add(self, tip: Vec3, push: Vec3, force: Floats) -> None:
        """Add a period: tip [m], force on the hand [N], and force of every hand (n,) [N]."""
        if self._periods % round(STEP / PERIOD) == 0 or self._felt is None:
            self._felt = np.zeros(len(force))
        self._felt = np.maximum(self._felt, force)
        self._sums += (tip, push)
        self._periods += 1
        if self._periods % BLOCK == 0:
            blocks = round(WINDOW / PERIOD / BLOCK)
            self._tips = [*self._tips, self._sums[0] / BLOCK][-blocks:]
            self._pushes = [*self._pushes, self._sums[1] / BLOCK][-blocks:]
            self._sums = np.zeros((2, 3))
        done = self._periods % round(STEP / PERIOD) == 0
        self.due = done and self._periods * PERIOD >= WINDOW

    def take(self, contact: Complex) -> None:
        """Take in the last window, with the stiffness of the contact (f,) while it is closed."""
        tips, pushes = np.array(self._tips), np.array(self._pushes)
        mean = pushes.mean(axis=0)
        size = float(np.linalg.norm(mean))
        if size < 1e-3:
            return
        outward = mean / size
        force = pushes @ outward
        closed = float((force > 1e-3).mean())
        window = seen(-(tips @ outward)[None], force[None])
        self.clouds.take(window, closed * contact[None])
