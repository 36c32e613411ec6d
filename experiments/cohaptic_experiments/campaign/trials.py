"""The trials of the campaign `hands`: rooms of one to eight hands, drawn by seed.

`draw` is the ensemble of science 3.4: hands of 0.05-0.5 kg, 1-10 N s/m, 100-1000 N/m that press and
hold; objects of 50-800 N/m; simulation at 20-100 Hz; one-way delays of 0-250 ms with up to 60 ms of
jitter; contacts at least 40 mm apart, or anywhere on a slab. Half of the objects couple like the
balloon touched at random places, half like a soft slab (elastic half-space, whose contacts all push
in the same direction). `wide_trials.draw_wide` is the ensemble of science 3.11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import locate
from cohaptic_server.world.equilibrium import complementarity

MAX_USERS = 8
APART = 0.04  # m between contacts on the balloon: two diameters of a fingertip
SLAB_RADIUS = 0.01  # m, of a contact on the slab
SLAB_SIZE = 0.12  # m, of the square that is touched
STILL = 1e9  # s; a time after the end of every trial


def no_motion(n: int) -> Floats:
    """Hands that press and hold, shape (n, 9); see `Trial.motion`."""
    motion = np.zeros((n, 9))
    motion[:, 6:8] = STILL
    return motion


@dataclass(frozen=True, eq=False)
class Trial:
    """One room: hands, object, devices and links.

    Args:
        object: `balloon` or `slab`.
        C: Compliance of the contacts along their normals, shape (n, n) [m/N].
        mass: Mass of each hand, shape (n,) [kg]; likewise damping [N s/m] and stiffness [N/m].
        depth: Depth of each intention below the resting surface, shape (n,) [m].
        press_at: When each hand presses, shape (n,) [s].
        simulation_period: N T [s].
        up: One-way delay to the server, shape (n,) [s]; `down` back.
        jitter: Largest extra delay of each message, one way, shape (n,) [s].
        seed: Seed of the jitter.
        max_stiffness: That each device renders, shape (n,) [N/m]; None: it is not on trial.
        budget: What each device may damp, shape (n,) [N s/m]; None: as the campaign's row says.
        friction: mu of each contact, shape (n,); None: none.
        loss: Share of messages lost, shape (n,); None: none.
        motion: Further motion of the hands, rows as in `kernel.haptics`, shape (n, 9).
        along: Tangential compliance of a contact as a share of its normal one.
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
    max_stiffness: Floats | None = None
    budget: Floats | None = None
    friction: Floats | None = None
    loss: Floats | None = None
    motion: Floats = field(default_factory=lambda: np.zeros((0, 9)))
    along: float = 0.7

    @property
    def gains(self) -> Floats:
        """K_i of each hand: the object's stiffness or the device's, shape (n,) [N/m]."""
        k = 1.0 / np.diag(self.C)
        return k if self.max_stiffness is None else np.minimum(k, self.max_stiffness)

    @property
    def reference(self) -> Floats:
        """Force on each hand in static equilibrium, without network and law, shape (n,) [N].

        Where a device is softer than the object, the hand presses on the device's spring.
        """
        C = self.C - np.diag(np.diag(self.C)) + np.diag(1.0 / self.gains)
        return complementarity(C + np.diag(1.0 / self.stiffness), self.depth)

    @property
    def blocks(self) -> Floats:
        """Compliance in all directions, each contact in its own frame, shape (3 n, 3 n) [m/N].

        Along the surface the contacts couple as along their normals, in the share `along`.
        """
        n = len(self.C)
        C = np.zeros((3 * n, 3 * n))
        C[::3, ::3] = self.C
        C[1::3, 1::3] = C[2::3, 2::3] = self.along * self.C
        return C

    @property
    def loop_delay(self) -> Floats:
        """Largest delay that the server would measure (`control.delay`), shape (n,) [s]."""
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
        motion=no_motion(n),
    )


def without_coupling(trial: Trial) -> Trial:
    """The same hands, each with an object of its own."""
    return replace(trial, C=np.diag(np.diag(trial.C)))


def balloon_coupling(rng: np.random.Generator, n: int, apart: float = APART) -> Floats:
    """C of n contacts at random vertices of the balloon, shape (n, n) [m/N]."""
    points, C = _balloon_contacts()
    chosen: list[int] = []
    while len(chosen) < n:
        candidate = int(rng.integers(len(points)))
        gaps = np.linalg.norm(points[chosen] - points[candidate], axis=1)
        if (gaps > apart).all():
            chosen.append(candidate)
    return np.asarray(C[np.ix_(chosen, chosen)])


def slab_coupling(rng: np.random.Generator, n: int, size: float = SLAB_SIZE) -> Floats:
    """C of n contacts on a half-space, 1 / sqrt(1 + (r/a)^2): as 1/r far off, and definite."""
    points = rng.uniform(-0.5 * size, 0.5 * size, (n, 2))
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
        field = body.respond([replace(load, force=1.0)]).displacement_of(every)
        C[i] = [float(other.weights @ field[other.vertices] @ other.direction) for other in loads]
    return 0.5 * (C + C.T)
