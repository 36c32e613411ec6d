"""Models of the other hands in the loop: what is shown, and the forces that answer a press."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cohaptic.control.geometry import Sight
from cohaptic.control.hand_model import USUAL_HAND, Deflection, HandModel, deflect
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.partners import HEAVIEST, LIGHTEST, MAX_PARTNERS, Partner, Partners
from cohaptic.vec import ZERO, add, dot, scale, sub
from cohaptic_client.loop.answer import WISH_RATE, OwnHand, answer
from cohaptic_client.loop.replica import (
    Answer,
    Replica,
    follow,
    move,
    numbers_of,
    shown_numbers,
)
from tests.strategies import normals, vectors

Floats = npt.NDArray[np.float64]
K_H = 250.0  # N/m
LARGEST = 10.0  # N
DT = 0.001  # s
ROCK = HandModel(10.0, 100.0, 1e4)

fractions = st.floats(0.0, 1.0)
seeds = st.integers(0, 2**32 - 1)
sights = st.builds(
    Sight,
    depth=st.floats(-0.02, 0.02),
    normal=normals,
    c_ii=st.just(1.0 / K_H),
    own_force=vectors(5.0),
    u_others=vectors(0.02),
)
weights = st.floats(0.0, 1.0)


def some(users: Sequence[int], seed: int, weight: float) -> Partners:
    """Hands on a body of a few hundred N/m, in this order, that share half of what yields."""
    rng = np.random.default_rng(seed)
    n = len(users) + 1
    mixed = rng.standard_normal((n, n))
    C = 0.002 * (mixed @ mixed.T / n + np.eye(n) + np.ones((n, n)))
    return Partners(
        weight,
        LARGEST,
        USUAL_HAND,
        tuple(
            Partner(
                user, HandModel(*rng.uniform([0.05, 1.0, 100.0], [0.5, 10.0, 1000.0]).tolist()),
                float(rng.uniform(-0.01, 0.02)), float(rng.uniform(0.0, 0.01)),
                float(rng.uniform(0.0, 3.0)), float(rng.uniform(1.0, 10.0)), float(C[j + 1, j + 1]),
                tuple(C[j + 1, : j + 1].tolist()),
            )
            for j, user in enumerate(users)
        ),
    )  # fmt: skip


# Few numbers, so that two of them have many users in common.
orders = st.permutations(range(1, 10)).flatmap(
    lambda users: st.integers(0, MAX_PARTNERS).map(lambda n: users[:n])
)
rooms = st.builds(some, orders, seeds, weights)


class Shown:
    """What a loop shows of the partners: by user, and by pair of users; 0 is the own hand."""

    def __init__(self, replica: Replica, fraction: float) -> None:
        numbers, users = list(shown_numbers(replica, fraction)), replica.news.users
        self.weight = numbers.pop(0)
        self.of: dict[int, tuple[float, float, float, float]] = {}
        self.between: dict[frozenset[int], float] = {}
        for j, user in enumerate(users):
            intended, force, max_force, c_jj = numbers[:4]
            self.of[user] = (intended, force, max_force, c_jj)
            for k, other in enumerate((0, *users[:j])):
                self.between[frozenset((user, other))] = numbers[4 + k]
            del numbers[: 5 + j]
        assert numbers == []

    @classmethod
    def report(cls, news: Partners) -> Shown:
        """What a patch says."""
        return cls(follow(None, news, 1.0), 1.0)


@given(rooms, seeds, weights, fractions)
def test_the_same_partners_are_shown_on_where_they_were(
    first: Partners, seed: int, weight: float, fraction: float
) -> None:
    users = first.users
    replica = follow(follow(None, first, 1.0), some(users, seed, weight), 1.0)
    before = shown_numbers(replica, fraction)
    after = follow(replica, some(users, seed ^ 1, 1.0 - weight), fraction)
    assert shown_numbers(after, 0.0) == before
    assert (after.deflections, after.forces) == (replica.deflections, replica.forces)
    assert shown_numbers(after, 1.0) == numbers_of(after.news)


@given(orders, orders, seeds, weights, fractions)
def test_the_models_of_those_who_stay_go_on_in_whatever_order_others_come_and_go(
    old: list[int], new: list[int], seed: int, weight: float, fraction: float
) -> None:
    """Each number by user and pair of users, and so independent of places in a patch."""
    replica = follow(follow(None, some(old, seed, weight), 1.0), some(old, seed + 1, 0.5), 1.0)
    deflections = [Deflection(0.001 * i, 0.01 * i) for i in range(len(old) + 1)]
    replica = move(
        Replica(
            replica.news,
            replica.before,
            replica.after,
            [],
            replica.models,
            deflections,
            replica.forces,
            [],
        ),
        answered([0.5 * i for i in range(len(old) + 1)]),
        0.0,
        0.0,
    )
    news = some(new, seed + 2, 1.0 - weight)
    after = follow(replica, news, fraction)
    now, says = Shown(after, 0.0), Shown.report(news)
    if old == new:
        now, says = Shown(after, 1.0), Shown.report(news)
    assert (now.weight, now.of, now.between) == (says.weight, says.of, says.between)
    for j, user in enumerate((0, *new)):
        if user in (0, *old):
            i = (0, *old).index(user)
            assert (after.deflections[j], after.forces[j]) == (
                replica.deflections[i],
                replica.forces[i],
            )
        else:
            p = news.partners[j - 1]
            assert (after.deflections[j], after.forces[j]) == (Deflection(p.deflection), p.force)


def answered(forces: list[float]) -> Answer:
    """An answer with these forces."""
    nothing = Sight(0.0, (0.0, 0.0, 1.0), 1.0 / K_H, ZERO, ZERO)
    return Answer(forces, [], nothing, 0.0, 0.0, 0.0, 0.0)


def ask(
    replica: Replica, sight: Sight, fraction: float = 1.0, k_h: float = K_H
) -> tuple[list[float], Sight]:
    """The answer of models that have shown their surface for long."""
    steady = replace(replica, step=0.0)
    found = answer(
        steady,
        sight,
        fraction,
        OwnHand(k_h, 1.0 / K_H, LARGEST, 1.0, math.inf, 0.0, 0.0, WISH_RATE),
        DT,
    )
    return found.forces, found.sight


def matrix_of(news: Partners) -> Floats:
    """C of a patch, with the own contact first and the own device in place of its own entry."""
    n = len(news.partners) + 1
    C = np.zeros((n, n))
    C[0, 0] = 1.0 / K_H
    for j, p in enumerate(news.partners, start=1):
        C[j, j], C[j, :j] = p.c_jj, p.coupled
        C[:j, j] = p.coupled
    return C


@given(rooms, sights, seeds)
def test_forces_are_those_of_the_matrix(news: Partners, sight: Sight, seed: int) -> None:
    """C f = x, with the forces of the surface taken out of the own depth."""
    assume(news.partners)
    C, n = matrix_of(news), len(news.partners) + 1
    assume(np.linalg.eigvalsh(C)[0] > 1e-5)
    pressed = np.random.default_rng(seed).uniform(0.0, 0.99, n)
    pressed *= [LARGEST, *[p.max_force for p in news.partners]]
    depth = C @ pressed
    wanted = tuple(
        p._replace(intended=p.deflection + float(x))
        for p, x in zip(news.partners, depth[1:], strict=True)
    )
    in_surface = float(C[0, 1:] @ [p.force for p in news.partners])
    sight = replace(sight, depth=float(depth[0]) - in_surface)
    replica = follow(None, Partners(1.0, LARGEST, USUAL_HAND, wanted), 1.0)
    forces, shown = ask(replica, sight)
    assert forces == pytest.approx(pressed.tolist(), abs=1e-9)
    # The law, with its gain on this surface, then gives the first of these forces.
    assert shown.depth * K_H == pytest.approx(forces[0], abs=1e-3)


@given(rooms, sights, weights)
def test_only_the_displacement_by_others_moves_along_the_normal(
    news: Partners, sight: Sight, weight: float
) -> None:
    replica = follow(None, Partners(weight, LARGEST, news.model, news.partners), 1.0)
    _, shown = ask(replica, sight)
    moved, n = sub(shown.u_others, sight.u_others), sight.normal
    along = dot(moved, n) / dot(n, n)
    assert sub(moved, scale(n, along)) == pytest.approx(ZERO, abs=1e-12)
    assert shown.depth - sight.depth == pytest.approx(along, abs=1e-12)
    assert add(sight.u_others, scale(n, along)) == pytest.approx(shown.u_others, abs=1e-12)


@given(
    st.floats(0.0, 0.02), st.floats(0.0, 0.02), st.floats(0.0, 5.0), st.floats(0.0005, 0.01),
    st.floats(-0.9, 0.9),
)  # fmt: skip
def test_a_hand_that_does_not_yield_answers_as_the_closed_solution_says(
    depth: float, intended: float, force: float, c_jj: float, coupling: float
) -> None:
    c = coupling * math.sqrt(c_jj / K_H)
    news = Partners(
        1.0, LARGEST, USUAL_HAND, (Partner(2, ROCK, intended, 0.0, force, 100.0, c_jj, (c,)),)
    )
    sight = Sight(depth, (0.0, 0.0, 1.0), 1.0 / K_H, ZERO, ZERO)
    forces, shown = ask(follow(None, news, 1.0), sight)
    # Without the other's force the own depth is x_0; two springs that share c.
    x0, x1 = depth + c * force, intended
    determinant = c_jj / K_H - c * c
    f0, f1 = (c_jj * x0 - c * x1) / determinant, (x1 / K_H - c * x0) / determinant
    if f0 < 0.0:
        f0, f1 = 0.0, max(0.0, x1 / c_jj)
    elif f1 < 0.0:
        f0, f1 = max(0.0, K_H * x0), 0.0
    if f0 > LARGEST:
        f0, f1 = LARGEST, max(0.0, (x1 - c * LARGEST) / c_jj)
    assume(f1 < 100.0)
    assert forces == pytest.approx([f0, f1], abs=1e-9)
    assert shown.depth == pytest.approx(x0 - c * f1, abs=1e-6)


@given(rooms, sights, weights)
def test_models_with_the_forces_of_the_surface_leave_it_as_it_came(
    news: Partners, sight: Sight, weight: float
) -> None:
    """At rest a patch and its models agree, and no share of the models changes anything."""
    assume(news.partners and 0.0 < sight.depth < LARGEST / K_H)
    C = matrix_of(news)
    carried = np.array([K_H * sight.depth, *[0.1 * p.max_force for p in news.partners]])
    agreed = tuple(
        p._replace(force=float(f), intended=p.deflection + float(x))
        for p, f, x in zip(news.partners, carried[1:], (C @ carried)[1:], strict=True)
    )
    replica = follow(None, Partners(weight, LARGEST, USUAL_HAND, agreed), 1.0)
    exact = replace(replica, forces=carried.tolist())
    forces, shown = ask(exact, sight)
    assert forces == pytest.approx(carried.tolist(), abs=1e-9)
    assert shown.depth == pytest.approx(sight.depth, abs=1e-12)
    assert ask(replica, sight)[1].depth == pytest.approx(sight.depth, abs=1e-7)


@given(rooms, seeds, st.floats(0.0, 10.0), st.floats(0.0, 0.002))
def test_the_own_model_gives_way_to_the_own_force_and_others_to_theirs(
    news: Partners, seed: int, own: float, dt: float
) -> None:
    rng = np.random.default_rng(seed)
    forces = rng.uniform(0.0, 10.0, len(news.partners) + 1).tolist()
    replica = follow(None, news, 1.0)
    after = move(replica, answered(forces), own, dt)
    models = [news.model, *[p.model for p in news.partners]]
    felt = [own, *forces[1:]]
    for deflection, then, model, force in zip(
        replica.deflections, after.deflections, models, felt, strict=True
    ):
        assert then == deflect(deflection, model, force, dt)
    assert after.forces == felt
    assert (after.news, after.before, after.after) == (replica.news, replica.before, replica.after)


@given(st.integers(1, 40), st.integers(2, 200))
def test_no_model_leaves_every_workspace_however_its_hand_is_described(
    ticks: int, periods: int
) -> None:
    """A server may describe a hand otherwise in each patch, and so pump what the model holds."""
    soft = HandModel(LIGHTEST.mass, LIGHTEST.damping, LIGHTEST.stiffness)
    stiff = HandModel(LIGHTEST.mass, LIGHTEST.damping, HEAVIEST.stiffness)
    replica: Replica | None = None
    for tick in range(ticks):
        model = (soft, stiff)[tick % 2]
        partner = Partner(2, model, 20.0, 10.0, 300.0, 100.0, 1e-6, (10.0,))
        replica = follow(replica, Partners(1.0, LARGEST, model, (partner,)), 1.0)
        for _ in range(periods):
            replica = move(replica, answered([100.0, 100.0]), 100.0, 2.0 * DT)
            for deflection in replica.deflections:
                assert abs(deflection.y) <= MAX_POSITION


@given(rooms, rooms, sights, fractions)
def test_partners_who_come_or_go_make_no_step(
    first: Partners, news: Partners, sight: Sight, fraction: float
) -> None:
    own = OwnHand(K_H, 1.0 / K_H, LARGEST, 1.0, math.inf, 0.0, 0.0, WISH_RATE)
    replica = follow(None, first, 1.0)
    before = answer(replica, sight, 1.0, own, DT)
    replica = follow(move(replica, before, before.forces[0], 0.0), news, 1.0)
    after = answer(replica, sight, 0.0, own, 0.0)
    if first.users != news.users:
        assert after.shift == pytest.approx(before.shift, abs=1e-12)
    step = abs(after.step)
    for _ in range(400):  # 0.4 s, four time constants of the fade
        after = answer(replica, sight, 1.0, own, DT)
        step = max(step, abs(after.step))  # the surface moves to the patch in the first period
        replica = replace(replica, step=after.step, shift=after.shift, wishes=after.wishes)
    steady = answer(replace(replica, step=0.0), sight, 1.0, own, DT)
    assert after.shift == pytest.approx(steady.shift, abs=1e-9 + 0.02 * step)


@given(rooms, st.floats(0.001, 0.03), st.floats(0.2, 1.0), weights)
def test_no_device_renders_more_than_it_can(
    news: Partners, depth: float, fraction: float, given_fraction: float
) -> None:
    """Nor less than the gain of its law, where the others hold their tips."""
    max_force = K_H / fraction
    sight = Sight(depth, (0.0, 0.0, 1.0), 1.0 / K_H, ZERO, ZERO)
    replica = replace(follow(None, news, 1.0), step=0.0)
    own = OwnHand(K_H, 1.0 / K_H, LARGEST, given_fraction, max_force, 0.0, 0.0, WISH_RATE)
    found = answer(replica, sight, 1.0, own, DT)
    deeper = Sight(depth + 1e-6, sight.normal, sight.c_ii, ZERO, ZERO)
    more = answer(replica, deeper, 1.0, own, DT)
    rendered = K_H * (more.sight.depth - found.sight.depth) / 1e-6
    assume(0.0 < found.forces[0] < LARGEST and 0.0 < more.forces[0] < LARGEST)
    assert rendered <= max_force * (1.0 + 1e-6) or given_fraction < 1.0


def test_a_force_that_the_hand_does_not_get_is_none_for_the_others() -> None:
    partner = Partner(2, USUAL_HAND, 0.01, 0.0, 0.0, 10.0, 1.0 / K_H, (0.5 / K_H,))
    replica = replace(follow(None, Partners(1.0, LARGEST, USUAL_HAND, (partner,)), 1.0), step=0.0)
    sight = Sight(0.01, (0.0, 0.0, 1.0), 1.0 / K_H, ZERO, ZERO)
    found = answer(
        replica,
        sight,
        1.0,
        OwnHand(K_H, 1.0 / K_H, LARGEST, 0.0, math.inf, 0.0, 0.0, WISH_RATE),
        DT,
    )
    assert found.forces == [0.0, pytest.approx(0.01 * K_H)]
    weak = Partners(1.0, 1.0, USUAL_HAND, (partner,))  # the body takes no more than 1 N
    replica = replace(follow(None, weak, 1.0), step=0.0)
    found = answer(
        replica,
        sight,
        1.0,
        OwnHand(K_H, 1.0 / K_H, LARGEST, 1.0, math.inf, 0.0, 0.0, WISH_RATE),
        DT,
    )
    assert found.forces[0] == pytest.approx(1.0)
