"""Surfaces that others move, turn and soften, under the hands of whole loops."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import settings as tried
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.law import Law
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.vec import ZERO, Vec3, add, norm, scale, sub, unit
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.passivity import Passivity
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.safety import EXTERNAL_RATE, Mode, SafetyLimits, SafetyState, rate_of
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from tests.client.loop.slew_cases import BALL, PERIOD, SKEWED, STEP, TICK, seeds
from tests.client.plane import PLANE
from tests.examples_of_laws import examples


class Held:
    """A hand that was pressed in and holds, and patches through frames as a server sends them."""

    def __init__(
        self,
        make: Callable[[int], Patch],
        *,
        depth: float,
        device: float = 2000.0,
        friction: float = 0.0,
        damping: float = 0.0,
    ) -> None:
        limits = SafetyLimits(max_rate=rate_of(device))
        self.settings = LoopSettings(
            TICK, limits, max_damping=damping, friction=friction, max_stiffness=device
        )
        self.make, self.tick, self.now = make, 1, 10.0
        engaged = SafetyState(Mode.ENGAGED, 1.0, ZERO, 4, self.now - PERIOD)
        first = receive(LoopState(), self._patch(), self.now - TICK, self.settings)
        self.state = replace(first, safety=engaged)
        self.next = self.now
        self.probe: Vec3 = (0.0, 0.0, 1e-3)
        for k in range(201):
            self.go((0.0, 0.0, 1e-3 - k / 200.0 * (1e-3 + depth)))
        self.rest(50)

    def _patch(self) -> Patch:
        return Patch.decode(replace(self.make(self.tick), tick=self.tick).encode())

    def go(self, probe: Vec3, dt: float = PERIOD) -> Period:
        """One period with the tip at `probe`."""
        self.now += dt
        if self.now >= self.next:
            self.tick, self.next = self.tick + 1, self.now + TICK
            self.state = receive(self.state, self._patch(), self.now, self.settings)
        velocity = scale(sub(probe, self.probe), 1.0 / dt) if dt > 0.0 else ZERO
        self.probe = probe
        self.state, output = step(
            self.state, DeviceSample(probe, velocity), self.now, self.settings
        )
        return output

    def rest(self, periods: int) -> list[Period]:
        return [self.go(self.probe) for _ in range(periods)]


def unexplained(outputs: list[Period], first: Vec3) -> float:
    """Largest change of force of a hand at rest in one period [N]."""
    forces = [first, *(o.force for o in outputs)]
    return max(norm(sub(b, a)) for a, b in itertools.pairwise(forces))


def plane(c: float = 1e-3, n: Vec3 = (0.0, 0.0, 1.0), **changes: Any) -> Patch:
    found = replace(PLANE, law=Law.PREDICTIVE, c_ii=c, k_h=1.0 / c, integral_gain=0.0)
    return replace(found, x_free=ZERO, normal=unit(n), **changes)


@pytest.mark.parametrize("turn", [0.05, 0.3, 1.0, 2.0, 3.0, math.pi])
@pytest.mark.parametrize("friction", [0.0, 0.5, 1.0])
def test_a_surface_that_turns_turns_the_force_slowly(turn: float, friction: float) -> None:
    """Sticking or not; the anchor does not wind up while the direction is held back."""
    n: list[Vec3] = [(0.0, 0.0, 1.0)]
    C = BALL if friction else None
    hand = Held(lambda _: plane(n=n[0], compliance=C), depth=0.005, friction=friction)
    before = hand.state.safety.force
    n[0] = (math.sin(turn), 0.0, math.cos(turn))
    outputs = hand.rest(1500)
    assert unexplained(outputs, before) <= STEP
    if friction and turn <= 0.3:
        assert norm(hand.state.friction.force) <= min(friction, turn) * 5.3  # f_n = 5 N


@pytest.mark.parametrize("turn", [0.0, 1.57, 3.0, math.pi])
@pytest.mark.parametrize("force", [2.0, 5.0, 9.5])
def test_a_force_ends_when_the_contact_does_however_the_surface_turned(
    turn: float, force: float
) -> None:
    gone = [False]

    def make(_: int) -> Patch:
        if not gone[0]:
            return plane()
        n = (math.sin(turn), 0.0, math.cos(turn))
        return replace(plane(n=n), x_free=scale(n, -0.03))

    hand = Held(make, depth=1e-3 * force)
    gone[0] = True
    outputs = hand.rest(round(force / EXTERNAL_RATE / PERIOD) + 30)
    assert outputs[-1].force == ZERO


def test_through_the_middle_of_a_small_ball_the_force_ends_on_the_other_side() -> None:
    ball = replace(plane(), geometry=Geometry.SPHERE, curvature=200.0)
    hand = Held(lambda _: ball, depth=0.002)
    for k in range(400):
        hand.go((0.0, 0.0, -0.002 - k * 3e-5))
    assert hand.rest(700)[-1].force == ZERO


@pytest.mark.parametrize("to", [SKEWED, Compliance3(1e-3, 1e-3, 1e-3, 0.0, -4e-4, 2e-4), None])
def test_another_compliance_moves_the_force_slowly(to: Compliance3 | None) -> None:
    C: list[Compliance3 | None] = [BALL]
    hand = Held(lambda _: plane(compliance=C[0]), depth=0.005, friction=0.5)
    hand.go((0.0005, 0.0, hand.probe[2]))
    before = hand.rest(30)[-1].force
    C[0] = to
    assert unexplained(hand.rest(400), before) <= STEP


@given(seeds, st.sampled_from([0.0, 0.5]), st.booleans(), st.sampled_from([200, 1000, 10_000]))
@tried(max_examples=examples(30))
def test_no_legal_patches_move_the_force_of_a_hand_but_slowly(
    seed: int, friction: float, moves: bool, device: int
) -> None:
    """Predictive law; surfaces that jump, turn, bend and change, late and in bursts."""
    rng = random.Random(seed)
    assume(not (moves and friction))  # friction moves by more than K times the way where it slips
    c = 10.0 ** rng.uniform(-4.0, -2.0)
    K = min(1.0 / c, device)

    def make(_: int) -> Patch:
        here = c * rng.uniform(0.7, 1.4)
        C = Compliance3(here, here, here, 0.0, 0.0, 0.0) if friction else None
        return replace(
            plane(here, (rng.gauss(0.0, 0.1), rng.gauss(0.0, 0.1), 1.0), compliance=C),
            k_h=min(1.0 / here, device),
            x_free=(rng.gauss(0.0, 5e-4), rng.gauss(0.0, 5e-4), rng.gauss(0.0, 2.0 / K)),
            curvature=rng.choice([0.0, rng.uniform(-20.0, 20.0)]),
            geometry=Geometry.SPHERE,
            own_force=(0.0, 0.0, rng.uniform(0.0, 5.0)),
            u_others=(rng.gauss(0.0, 1e-3), rng.gauss(0.0, 1e-3), rng.gauss(0.0, 1e-3)),
        )

    hand = Held(make, depth=4.0 / K, device=float(device), friction=friction)
    way, rate = rng.uniform(0.0, 2.0 / K), rng.uniform(3.0, 75.0)
    at, force = hand.probe, hand.state.safety.force
    for k in range(600):
        probe = add(at, (0.0, 0.0, way * math.sin(1e-3 * rate * k) if moves else 0.0))
        own = max(K, 1.4 / c if 1.4 / c < device else device) * norm(sub(probe, hand.probe))
        output = hand.go(probe)
        assert norm(sub(output.force, force)) <= own + STEP
        force = output.force


@pytest.mark.parametrize("speed", [0.0, 0.05, 0.2])
def test_a_hand_on_its_way_in_gives_others_no_room_to_turn_its_force(speed: float) -> None:
    """On a plane the hand's own way turns nothing."""
    n: list[Vec3] = [(0.0, 0.0, 1.0)]
    hand = Held(lambda _: plane(c=5e-4, n=n[0]), depth=0.001)
    n[0] = (math.sin(1.0), 0.0, math.cos(1.0))
    force, z = hand.state.safety.force, hand.probe[2]
    for k in range(1, 20):
        output = hand.go((0.0, 0.0, z - k * speed * PERIOD))
        assert norm(sub(output.force, force)) <= 2000.0 * speed * PERIOD + STEP
        force = output.force


@pytest.mark.parametrize("late", [0.005, 0.019])
def test_a_late_period_counts_as_two(late: float) -> None:
    c, law = [1e-3], [Law.PREDICTIVE]

    def make(_: int) -> Patch:
        weaker = replace(plane(c[0]), law=law[0])
        return replace(weaker, k_h=0.5 / c[0]) if law[0] is Law.PROPORTIONAL else weaker

    hand = Held(make, depth=0.005)
    c[0], law[0] = 2e-3, Law.PROPORTIONAL
    force = hand.state.safety.force
    for _ in range(40):
        output = hand.go(hand.probe, late)
        assert norm(sub(output.force, force)) <= 2.0 * STEP
        force = output.force


@given(
    st.sampled_from(Law),
    st.floats(0.0, 1e6),
    st.floats(-6.0, -2.0),
    st.booleans(),
    st.integers(1, 9),
)
def test_no_patch_gives_a_hand_more_than_its_device_renders(
    law: Law, k_h: float, exponent: float, follow: bool, periods: int
) -> None:
    patch = replace(plane(10.0**exponent), law=law, k_h=k_h)
    settings = LoopSettings(TICK, SafetyLimits(), follow=follow, max_stiffness=2000.0)
    state, now = LoopState(), 10.0
    for k in range(periods):
        state = receive(state, replace(patch, tick=k + 1), now, settings)
        now += PERIOD
        state, _ = step(state, DeviceSample(ZERO, ZERO), now, settings)
        assert state.k_h <= 2000.0


@pytest.mark.parametrize("back", [-0.5, -1000.0])
def test_time_that_goes_back_moves_nothing(back: float) -> None:
    hand = Held(lambda _: plane(), depth=0.003)
    before = hand.state.safety.force
    hand.next = -math.inf
    assert norm(sub(hand.go(hand.probe, back).force, before)) <= STEP
    assert hand.state.k_h == pytest.approx(1000.0)


@pytest.mark.parametrize("stiffness", [500.0, 3000.0, 10_000.0])
def test_a_closed_way_along_a_surface_makes_no_energy_on_any_device(stiffness: float) -> None:
    """Of 2,000 N/m: the spring of the friction has no more, however stiff the object."""
    c = 1.0 / stiffness
    C = Compliance3(c, c, c, 0.0, 0.0, 0.0)
    hand = Held(lambda _: plane(c, compliance=C), depth=0.002, friction=2.0, damping=8.0)
    z, worst = hand.probe[2], 0.0
    for k in range(2000):
        x = 1e-3 * math.sin(2.0 * math.pi * k / 500.0)
        hand.go((x, 0.0, z))
        worst = max(worst, hand.state.passivity.owed)
    assert worst < 1e-9
    assert hand.state.passivity.damping < 1e-6


@given(seeds)
@tried(max_examples=examples(20))
def test_the_body_never_gets_more_than_the_law_or_the_limit(seed: int) -> None:
    """Even while the damping takes nearly all of the law's force, or the limit cuts it."""
    rng = random.Random(seed)
    hand = Held(lambda _: plane(5e-4), depth=0.003, damping=8.0)
    size, rate = rng.uniform(5e-4, 0.01), rng.uniform(12.0, 400.0)
    z = hand.probe[2]
    for k in range(250):
        owing = hand.state.passivity
        hand.state = replace(hand.state, passivity=Passivity(0.02, owing.damping, owing.stored))
        output = hand.go((0.0, 0.0, z + size * math.sin(1e-3 * rate * k)))
        assert norm(output.on_body) <= min(output.local.normal_force, 10.0) + 1e-9


def test_what_is_no_number_goes_to_nobody() -> None:
    hand = Held(lambda _: plane(), depth=0.003)
    before = norm(hand.state.safety.force)
    for _ in range(25):
        output = hand.go((math.nan, 0.0, -0.003))
        assert all(math.isfinite(x) for x in (*output.force, *output.on_body))
        # What is let go is let go on both sides.
        assert norm(output.on_body) <= norm(output.force) + 1e-9 <= before + 2e-9
    output = hand.go((math.nan, 0.0, -0.003))
    assert output.force == output.on_body == ZERO
