from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cohaptic.vec import Vec3, norm, scale, sub, unit
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import locate
from cohaptic_server.world.equilibrium import Equilibrium, RestingHand, complementarity, solve
from tests.examples_of_laws import examples
from tests.server.fields import free_of
from tests.system.spectral import random_compliance

RADIUS = 0.1  # m, of the balloons
HAND = 400.0  # N/m
CLOSE = 1e-6  # m; contacts are found to as much along a surface that tilts by up to a third
EXACT = 1e-7  # m; of contacts here
seeds = st.integers(0, 2**32 - 1)


def side(angle: float) -> Vec3:
    """A place on the equator [rad]."""
    return (math.cos(angle), math.sin(angle), 0.0)


# Far enough apart that contacts of 3 cm do not lie on each other.
corners = st.lists(st.integers(0, 5).map(side), min_size=1, max_size=4, unique=True)


def hand(at: Vec3, depth: float, stiffness: float = HAND) -> RestingHand:
    return RestingHand(scale(unit(at), RADIUS - depth), stiffness)


def problem(n: int, seed: int) -> tuple[Floats, Floats]:
    """Compliance of body and hands, and depths of either sign [m]."""
    rng = np.random.default_rng(seed)
    M = random_compliance(n, seed) + np.diag(1.0 / rng.uniform(100.0, 1000.0, n))
    return M, rng.uniform(-0.01, 0.02, n)


def height_over(body: Balloon, found: Equilibrium, i: int) -> float:
    """Height of tip i over the surface under all forces, own one included [m]."""
    free = [np.zeros_like(body.mesh.vertices)] * len(found.force)
    height = np.nan
    for _ in range(12):  # contacts follow the surface that follows them
        contacts = [
            locate(body.mesh, tip, field, radius=body.contact_radius, tolerance=EXACT)
            for tip, field in zip(found.tip, free, strict=True)
        ]
        response = body.respond([c.load(f) for c, f in zip(contacts, found.force, strict=True)])
        free = [free_of(response, j, f) for j, f in enumerate(found.force)]
        surface = contacts[i].moved(response.displacement)
        height = float(contacts[i].normal @ (found.tip[i] - surface))
    return height


@given(st.integers(1, 6), seeds)
@settings(deadline=None)
def test_complementarity_finds_what_trying_every_active_set_finds(n: int, seed: int) -> None:
    M, q = problem(n, seed)
    valid: list[Floats] = []
    for chosen in itertools.product([False, True], repeat=n):
        active = np.array(chosen)
        f = np.zeros(n)
        if active.any():
            f[active] = np.linalg.solve(M[np.ix_(active, active)], q[active])
        if (f >= 0.0).all() and (M @ f - q >= -1e-12).all():
            valid.append(f)
    # M is positive definite: there is one solution, were it not for a tie.
    assert valid
    # A thousandth of what the smallest force that matters here is, 1e-6 N.
    assert complementarity(M, q) == pytest.approx(valid[0], abs=1e-9)


@given(corners, st.lists(st.floats(-0.01, 0.02), min_size=4, max_size=4))
# Where contacts that stay as they may in a tick leave a tip 13 um off.
@example([side(0), side(1), side(4)], [0.015625] * 4)
@settings(max_examples=examples(15), deadline=None)
def test_tips_lie_on_the_surface_they_press_and_over_the_one_they_do_not(
    small_balloon: Balloon, at: list[Vec3], depths: list[float]
) -> None:
    hands = [hand(a, d) for a, d in zip(at, depths, strict=False)]
    found = solve(small_balloon, hands)
    assert (found.force >= 0.0).all()
    for i, (force, tip) in enumerate(zip(found.force, found.tip, strict=True)):
        height = height_over(small_balloon, found, i)
        assert height > -CLOSE
        if force > 0.0:
            assert height < CLOSE
        # And each hand is a spring between its intention and its tip.
        stretch = norm(sub((tip[0], tip[1], tip[2]), hands[i].intention))
        assert force == pytest.approx(HAND * stretch, abs=1e-4)


@given(st.floats(0.001, 0.02), st.floats(100.0, 1000.0), st.floats(-3.0, 3.0))
@settings(max_examples=examples(15), deadline=None)
def test_a_lone_hand_and_the_body_are_springs_in_a_row(
    small_balloon: Balloon, depth: float, stiffness: float, angle: float
) -> None:
    at = (math.cos(angle), math.sin(angle), 0.3)
    lone = hand(at, depth, stiffness)
    found = solve(small_balloon, [lone])
    # Depth counts from the facet in front of the hand, which lies inside the sphere.
    free = np.zeros_like(small_balloon.mesh.vertices)
    intention = np.array(lone.intention)
    contact = locate(small_balloon.mesh, intention, free, radius=small_balloon.contact_radius)
    depth = max(0.0, float(contact.normal @ (contact.point - intention)))
    k_o = 1.0 / found.compliance[0, 0]
    # The tip slides a little down the facet's slope as it is pushed out.
    expected = depth / (1.0 / k_o + 1.0 / stiffness)
    assert found.force[0] == pytest.approx(expected, rel=0.01, abs=1e-4)
    # What it feels of others is nothing, to the accuracy of the solution.
    assert found.felt_from_others[0] == pytest.approx(0.0, abs=1e-4)


def test_a_hand_just_off_the_body_is_pushed_by_another_that_presses(balloon: Balloon) -> None:
    """Pressing one side pushes the other out, into a hand that waits there."""
    waiting = hand((1.0, 0.0, 0.0), -0.001)
    assert solve(balloon, [waiting]).force[0] == 0.0
    found = solve(balloon, [waiting, hand((-1.0, 0.0, 0.0), 0.02)])
    assert found.force[0] > 0.2
    assert found.felt_from_others[0] == pytest.approx(found.force[0])
    assert found.alone[0] == 0.0


@given(st.permutations([0, 1, 2]))
@settings(max_examples=examples(6), deadline=None)
def test_nobody_is_served_first(small_balloon: Balloon, order: list[int]) -> None:
    hands = [hand((1.0, 0.0, 0.0), 0.01), hand((0.0, 1.0, 0.2), 0.02), hand((-1.0, 0.0, 0.5), 0.0)]
    straight = solve(small_balloon, hands)
    mixed = solve(small_balloon, [hands[i] for i in order])
    assert mixed.force == pytest.approx(straight.force[order], abs=1e-4)
    assert mixed.tip == pytest.approx(straight.tip[order], abs=1e-6)


@pytest.mark.parametrize("depth", [0.02, 0.04, 0.06])
@pytest.mark.parametrize("stiffness", [400.0, 2000.0])
def test_what_a_contact_turns_of_a_lone_hands_way_is_the_slope_over_its_stiffness(
    balloon: Balloon, depth: float, stiffness: float
) -> None:
    found = solve(balloon, [hand((1.0, 0.0, 0.0), depth, stiffness)])
    free = np.zeros_like(balloon.mesh.vertices)
    radius = balloon.contact_radius
    contact = locate(balloon.mesh, found.tip[0], free, radius=radius, tolerance=EXACT)
    geometric = (1.0 - contact.slope) / contact.slope / found.compliance[0, 0]  # K g, science 3.12
    # How the facets bend in both directions is fitted, a few percent apart.
    assert found.turning == pytest.approx(geometric / stiffness, rel=0.25)


def test_an_equilibrium_from_which_a_hand_would_slide_away_is_none(small_balloon: Balloon) -> None:
    """A hand of 5 N/m that wants to be beyond the middle, exactly opposite of where it would rest.

    There the sum of all forces is zero; a tenth of a millimetre aside it is pulled round the ball.
    """
    beyond, stiffness = 0.05, 5.0
    found = solve(small_balloon, [RestingHand((-beyond, 0.0, 0.0), stiffness, (0.15, 0.0, 0.0))])
    assert found.place[0, 0] == pytest.approx(-RADIUS, rel=0.01)
    assert found.force[0] == pytest.approx(stiffness * (RADIUS - beyond), rel=0.05)
