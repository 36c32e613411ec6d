"""Attacks on a hand: what a server, a link, a device and a machine may do, in virtual time.

An attack is a list of events; the loop under attack is `receive` and `step` of the product, so all
of its laws and limits. A hand that rests pressed in a plane is there before, and silence after.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.hand_model import USUAL_HAND
from cohaptic.control.law import Law
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.partners import HEAVIEST, LIGHTEST, Partner, Partners
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, add, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import LONGEST_PATIENCE, receive
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME, SAFETY_FADE_RATE, SafetyLimits, rate_of
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from tests.client.plane import PLANE
from tests.strategies import partners

PERIOD, TICK = 0.001, 16  # s; periods between the patches of a friendly server
SIMULATION_PERIOD = 1.0 / 60.0  # s
PRESSED: Vec3 = (0.0, 0.0, -0.004)
ABOVE: Vec3 = (0.0, 0.0, 0.003)
NAN, INF = math.nan, math.inf
MAX_OF_A_RELEASE = 1.5  # slope of a smooth ramp in its middle, over that of a straight one


Way = Callable[[int], Vec3]


def stands(_: int) -> Vec3:
    """Where it is put."""
    return ZERO


def creeps(_: int) -> Vec3:
    """5 mm/s sideways."""
    return (5e-6, 0.0, 0.0)


def trembles(n: int) -> Vec3:
    """0.1 mm at 10 Hz."""
    rate = 2.0 * math.pi * 10.0 * PERIOD
    return (1e-4 * (math.sin(rate * (n + 1)) - math.sin(rate * n)), 0.0, 0.0)


def trembles_in(n: int) -> Vec3:
    """The same in and out of the surface."""
    return (0.0, 0.0, trembles(n)[0])


def crosses(n: int) -> Vec3:
    """Below and above the speed from which on the damping counts, in turn."""
    return (9.9e-6 if n % 2 == 0 else 1.01e-5, 0.0, 0.0)


def slides(n: int) -> Vec3:
    """50 mm/s to and fro."""
    return (5e-5 if n // 400 % 2 == 0 else -5e-5, 0.0, 0.0)


@dataclass(frozen=True)
class Event:
    """Some periods of an attack.

    Args:
        patch: That comes in the first of them; None for none.
        tick: Of that patch, from the newest: 0 is a replay, below 0 one that comes late.
        dts: Time between periods, in turn [s].
        position: Where the device says it is in all of them, from where it was [m].
        velocity: That the device says it has [m/s].
        periods: How many.
    """

    patch: Patch | None
    tick: int
    dts: tuple[float, ...]
    position: Vec3
    velocity: Vec3
    periods: int


@dataclass
class Hand:
    """A hand under attack.

    Args:
        settings: Of its loop.
        forces: That the device was given [N].
        allowed: Largest change up to each of them [N].
        state: Of the loop.
        way: Of the hand in each period of an attack, by its number [m].
        ways: Length of the hand's way up to each of the forces [m].
        velocities: That the device said it had at each of them [m/s].
    """

    settings: LoopSettings
    forces: list[Vec3] = field(default_factory=lambda: [ZERO])
    allowed: list[float] = field(default_factory=lambda: [0.0])
    state: LoopState = field(default_factory=LoopState)
    now: float = 100.0
    newest: int = 0
    at: Vec3 = ABOVE
    way: Way = stands
    ways: list[float] = field(default_factory=lambda: [0.0])
    velocities: list[Vec3] = field(default_factory=lambda: [ZERO])

    def take(self, patch: Patch, behind: int = 1) -> None:
        """A patch comes, so many ticks behind the newest."""
        tick = max(1, self.newest + behind)
        self.newest = max(self.newest, tick)
        self.state = receive(self.state, replace(patch, tick=tick), self.now, self.settings)

    def period(self, sample: DeviceSample, dt: float = PERIOD) -> None:
        """One period of the loop, `dt` after the last."""
        self.now += dt
        before = self.state.probe
        self.state, output = step(self.state, sample, self.now, self.settings)
        limits = self.settings.limits
        release = MAX_OF_A_RELEASE * limits.max_force / FAULT_RELEASE_TIME
        counted = min(max(0.0, dt), 2.0 * limits.period)
        self.forces.append(output.force)
        self.ways.append(norm(sub(self.state.probe, before)))
        self.velocities.append(sample.velocity)
        self.allowed.append(max(limits.max_rate, release) * counted)

    def press(self) -> None:
        """Engage in front of a plane, press, and rest pressed."""
        target = add(PRESSED, ZERO)
        for n in range(850):
            if n % TICK == 0:
                self.take(PLANE)
            # The law of before may go with 10 N, and its transition ends at a rate relative to the
            # force: until little is left of that, the hand is not engaged.
            way = sub(target, self.at) if n > 400 else ZERO
            step_way = 1e-4  # m: 0.1 m/s
            size = norm(way)
            if size > 0.0:
                fraction = min(1.0, step_way / size)
                self.at = add(self.at, (way[0] * fraction, way[1] * fraction, way[2] * fraction))
            self.period(DeviceSample(self.at, ZERO))

    def tap(self, speed: float, rest: int) -> None:
        """Come out, press again at a speed [m/s], stop at once, and rest so many periods.

        An honest partner presses, too, and models of it are in use.
        """
        soft = PLANE.c_ii
        partner = Partner(2, USUAL_HAND, 0.005, 0.0, 0.0, 10.0, soft, (0.3 * soft,))
        honest = replace(PLANE, partners=Partners(1.0, 10.0, USUAL_HAND, (partner,)))
        self.retreat()
        for n in range(200):
            if n % TICK == 0:
                self.take(honest)
            self.period(DeviceSample(self.at, ZERO))
        resting = 0
        while resting < rest:
            if len(self.forces) % TICK == 0:
                self.take(honest)
            way = min(speed * PERIOD, self.at[2] - PRESSED[2])
            self.at = sub(self.at, (0.0, 0.0, way))
            resting += way == 0.0
            self.period(DeviceSample(self.at, (0.0, 0.0, -way / PERIOD)))

    def lift(self) -> None:
        """Be out of the object at once, and rest there."""
        self.at = ABOVE
        for _ in range(100):
            self.period(DeviceSample(self.at, ZERO))

    def retreat(self) -> None:
        """Come out of the plane as a hand does."""
        while self.at[2] < ABOVE[2]:
            self.at = add(self.at, (0.0, 0.0, 1e-4))
            self.period(DeviceSample(self.at, ZERO))

    def suffer(self, events: list[Event]) -> None:
        """An attack."""
        for event in events:
            if event.patch is not None:
                self.take(event.patch, event.tick)
            place = add(self.at, event.position)
            for n in range(event.periods):
                way, dt = self.way(len(self.forces)), event.dts[n % len(event.dts)]
                place = add(place, way)
                velocity = event.velocity if way == ZERO else scale(way, 1.0 / PERIOD)
                self.period(DeviceSample(place, velocity), dt)
            if norm(place) <= MAX_POSITION:
                self.at = place

    def silence(self) -> int:
        """Nothing comes any more, and the hand rests; periods until the force was gone for good."""
        max_force = LONGEST_PATIENCE + self.settings.limits.max_force / SAFETY_FADE_RATE
        periods = math.ceil((max_force + self.settings.limits.fade_time) / PERIOD) + 30
        for _ in range(periods):
            self.period(DeviceSample(self.at, ZERO))
        last = [n for n, force in enumerate(self.forces[-periods:]) if force != ZERO]
        return last[-1] + 1 if last else 0

    def steps(self, since: int = 1) -> list[float]:
        """Change of the force in each period [N]."""
        return [
            norm(sub(self.forces[n], self.forces[n - 1])) for n in range(since, len(self.forces))
        ]


odd = st.sampled_from([NAN, INF, -INF, 1e308, -1e308, 5e-324, -0.0])
coordinates = st.one_of(st.floats(-0.02, 0.02), st.floats(-10.0, 10.0))
odd_vectors = st.tuples(*[st.one_of(coordinates, odd)] * 3)
valid_vectors = st.tuples(*[st.floats(-5.0, 5.0)] * 3) | st.tuples(*[st.floats(-0.02, 0.02)] * 3)
normals = st.sampled_from(
    [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -0.6, 0.8), (0.8, 0.0, -0.6)]
)
SOFT = PLANE.c_ii
compliances = st.sampled_from(
    [
        None,
        Compliance3(SOFT, SOFT, SOFT, 0.0, 0.0, 0.0),
        Compliance3(0.003, 0.005, SOFT, 1e-3, 1e-3, -1e-3),
        Compliance3(1e-6, 1.0, SOFT, 0.0, 0.0, 0.0),
    ]
)
# Also those that no session would pass on.
wrong_compliances = st.one_of(
    compliances,
    st.builds(Compliance3, *[st.one_of(odd, st.floats(-0.01, 0.01))] * 6),
)
# Hands that a server makes up: any that the protocol allows, and some that a hand could be.
made_up = st.lists(st.integers(2, 4), min_size=1, max_size=3, unique=True).flatmap(
    lambda users: st.builds(
        Partners,
        weight=st.sampled_from([0.0, 0.5, 1.0]),
        max_force=st.sampled_from([0.0, 1.0, 10.0]),
        model=st.sampled_from([USUAL_HAND, LIGHTEST, HEAVIEST]),
        partners=st.tuples(
            *[
                st.builds(
                    Partner,
                    user=st.just(user),
                    model=st.sampled_from([USUAL_HAND, LIGHTEST, HEAVIEST]),
                    intended=st.sampled_from([-0.01, 0.0, 0.005, 0.02, 20.0]),
                    deflection=st.sampled_from([0.0, 0.01, -10.0]),
                    force=st.sampled_from([0.0, 2.0, 300.0]),
                    max_force=st.sampled_from([0.0, 10.0, 100.0]),
                    c_jj=st.sampled_from([SOFT, 1e-6, 10.0]),
                    coupled=st.tuples(*[st.sampled_from([0.5 * SOFT, -0.9 * SOFT, 0.0])] * (j + 1)),
                )
                for j, user in enumerate(users)
            ]
        ),
    )
)
# What a server may say that keeps to the protocol: `Patch` checks it.
valid_patches = st.builds(
    replace,
    st.just(PLANE),
    law=st.sampled_from(Law),
    x_free=st.just(ZERO) | valid_vectors,
    normal=normals,
    curvature=st.sampled_from([0.0, 6.0, -1e4, 1e4]),
    c_ii=st.sampled_from([SOFT, 1e-3 * SOFT, 1e-6, 10.0]),
    k_h=st.sampled_from([PLANE.k_h, 1e3 * PLANE.k_h, 0.0, 1e6]),
    integral_gain=st.sampled_from([0.0, 3000.0, 1e9]),
    own_force=st.just(ZERO) | valid_vectors.map(lambda v: (9.0 * v[0], 9.0 * v[1], 9.0 * v[2])),
    u_others=st.just(ZERO) | valid_vectors,
    compliance=compliances,
    partners=st.none() | made_up | made_up | partners,
)
# And what a broken network process would let through: the loop's own defence.
wrong_patches = st.builds(
    replace,
    valid_patches,
    x_free=odd_vectors | st.just(ZERO),
    normal=odd_vectors | normals,
    curvature=odd | st.just(0.0),
    c_ii=st.sampled_from([SOFT, -SOFT, 0.0, NAN, INF, 1e-300]),
    k_h=st.sampled_from([PLANE.k_h, -PLANE.k_h, NAN, INF, 1e300]),
    own_force=odd_vectors | st.just(ZERO),
    u_others=odd_vectors | st.just(ZERO),
    compliance=wrong_compliances,
)
small_moves = st.tuples(*[st.floats(-0.003, 0.003)] * 3)
timings = st.one_of(
    st.just((PERIOD,)),
    st.lists(st.floats(0.0, 0.019), min_size=1, max_size=4).map(tuple),
)
wrong_timings = timings | st.lists(
    st.sampled_from([0.0, -0.001, 1e-9, PERIOD, 0.05, 2.0, -0.5]), min_size=1, max_size=4
).map(tuple)
servers = st.builds(
    Event,
    patch=st.none() | valid_patches,
    tick=st.sampled_from([1, 1, 1, 0, -3, 1000]),
    dts=timings,
    position=st.just(ZERO),
    velocity=st.just(ZERO),
    periods=st.integers(1, 60),
)
punctual = servers.map(lambda event: replace(event, dts=(PERIOD,)))
anything = st.builds(
    Event,
    patch=st.none() | valid_patches | wrong_patches,
    tick=st.sampled_from([1, 1, 1, 0, -3, 1000]),
    dts=wrong_timings,
    position=st.one_of(st.just(ZERO), small_moves, small_moves, odd_vectors),
    velocity=st.one_of(st.just(ZERO), st.just(ZERO), odd_vectors),
    periods=st.integers(1, 60),
)
devices = st.sampled_from([(400.0, 3.3), (2000.0, 10.0), (8000.0, 12.0)])  # N/m, N
user_limits = st.sampled_from([1.0, 3.3, 10.0])  # N


@st.composite
def hands(draw: st.DrawFn) -> Hand:
    """A hand that rests pressed, on some device, with or without friction and damping."""
    stiffness, force = draw(devices)
    limits = SafetyLimits(
        max_force=min(force, draw(user_limits)),
        max_rate=rate_of(stiffness),
        engage_time=0.02,
        latch=draw(st.booleans()),
    )
    hand = Hand(
        LoopSettings(
            SIMULATION_PERIOD,
            limits,
            smoothing=draw(st.sampled_from([0.0, 1.0])),
            max_damping=draw(st.sampled_from([0.0, 8.0])),
            friction=draw(st.sampled_from([0.0, 0.3, 2.0])),
            max_stiffness=stiffness,
        )
    )
    hand.press()
    return hand
