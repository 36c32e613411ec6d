"""The trials of the campaign `hands`: rooms of one to eight hands, drawn by seed.

Ranges of science 3.4: hands of 0.05-0.5 kg, 1-10 N s/m, 100-1000 N/m; objects of 50-800 N/m;
simulation at 20-100 Hz; one-way delays of 0-250 ms with up to 60 ms of jitter. Half of the objects
couple like the balloon touched at random places, half like a soft slab (elastic half-space, whose
contacts all push in the same direction).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from cohaptic_server.bodies.balloon import Balloon
from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.contact import locate
from cohaptic_server.equilibrium import complementarity

MAX_USERS = 8
APART = 0.04  # m between contacts on the balloon: two diameters of a fingertip
SLAB_RADIUS = 0.01  # m, of a contact on the slab
SLAB_SIZE = 0.12  # m, of the square that is touched
CLEARANCE = 0.01  # m in front of the surface before the press


@dataclass(frozen=True, eq=False)
class Trial:
    """One room.

    Args:
        object: `balloon` or `slab`.
        C: Contact compliance, shape (n, n) [m/N].
        mass: Of each hand, shape (n,) [kg]; likewise damping [N s/m] and stiffness [N/m].
        depth: Of each intention below the resting surface, shape (n,) [m].
        press_at: When each hand presses, shape (n,) [s].
        simulation_period: N T [s].
        up: One-way delay to the server, shape (n,) [s]; `down` back.
        jitter: Largest extra delay of each message, one way, shape (n,) [s].
        seed: Of the jitter.
    """

    object: str
    C: Floats
    mass: Floats
    damping: Floats
    stiffness: Floats
    depth: Floats
    press_at: Floats
    simulation_period: float
    up: Floats
    down: Floats
    jitter: Floats
    seed: int

    @property
    def truth(self) -> Floats:
        """Force on each hand in equilibrium, no network, no law, shape (n,) [N]."""
        return complementarity(self.C + np.diag(1.0 / self.stiffness), self.depth)

    @property
    def loop_delay(self) -> Floats:
        """What the server would measure at most of each loop (`control.delay`), shape (n,) [s]."""
        way = self.up + self.down + 2.0 * self.jitter
        # A sample is sent once per period, and waits for the next tick.
        return np.asarray((np.ceil(way / self.simulation_period) + 2.0) * self.simulation_period)


def draw(seed: int, index: int) -> Trial:
    """Trial `index` of the campaign `seed`; the same numbers on every machine."""
    rng = np.random.default_rng([seed, index])
    n = int(rng.integers(1, MAX_USERS + 1))
    balloon = bool(rng.integers(0, 2))
    shape = balloon_coupling(rng, n) if balloon else slab_coupling(rng, n)
    k_o = math.exp(rng.uniform(math.log(50.0), math.log(800.0)))
    return Trial(
        object="balloon" if balloon else "slab",
        C=shape / (np.diag(shape).mean() * k_o),
        mass=rng.uniform(0.05, 0.5, n),
        damping=rng.uniform(1.0, 10.0, n),
        stiffness=rng.uniform(100.0, 1000.0, n),
        depth=rng.uniform(0.005, 0.03, n),
        press_at=rng.uniform(0.3, 1.0, n),
        simulation_period=1.0 / rng.uniform(20.0, 100.0),
        up=rng.uniform(0.0, 0.25, n),
        down=rng.uniform(0.0, 0.25, n),
        jitter=rng.uniform(0.0, 0.06, n),
        seed=int(rng.integers(0, 2**31)),
    )


def without_coupling(trial: Trial) -> Trial:
    """The same hands, each with an object of its own."""
    return replace(trial, C=np.diag(np.diag(trial.C)))


def balloon_coupling(rng: np.random.Generator, n: int) -> Floats:
    """C of n contacts at random vertices of the balloon, shape (n, n) [m/N]."""
    points, C = _balloon_contacts()
    chosen: list[int] = []
    while len(chosen) < n:
        candidate = int(rng.integers(len(points)))
        gaps = np.linalg.norm(points[chosen] - points[candidate], axis=1)
        if (gaps > APART).all():
            chosen.append(candidate)
    return np.asarray(C[np.ix_(chosen, chosen)])


def slab_coupling(rng: np.random.Generator, n: int) -> Floats:
    """C of n contacts on a half-space, 1 / sqrt(1 + (r/a)^2): as 1/r far off, and definite."""
    points = rng.uniform(-0.5 * SLAB_SIZE, 0.5 * SLAB_SIZE, (n, 2))
    r = np.linalg.norm(points[:, None] - points[None], axis=2)
    return np.asarray(1.0 / np.sqrt(1.0 + (r / SLAB_RADIUS) ** 2))


@lru_cache(maxsize=1)
def _balloon_contacts() -> tuple[Floats, Floats]:
    """Vertices that a hand can reach, and the compliance between contacts at all of them."""
    body = Balloon()
    x = body.mesh.vertices
    reachable = x[x[:, 2] > -0.6 * body.settings.radius]
    return reachable, contact_compliance(body, reachable)


def contact_compliance(body: Body, points: Floats) -> Floats:
    """C between contacts at `points` (n, 3) of the resting surface, shape (n, n) [m/N]."""
    still = np.zeros_like(body.mesh.vertices)
    loads: list[Load] = [
        locate(body.mesh, point, still, radius=body.contact_radius).load(0.0) for point in points
    ]
    every = np.arange(len(still))
    C = np.empty((len(loads), len(loads)))
    for i, load in enumerate(loads):
        field = body.respond([replace(load, force=1.0)]).at(every)
        C[i] = [float(other.weights @ field[other.vertices] @ other.direction) for other in loads]
    return 0.5 * (C + C.T)
