from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.world.applied_forces import anticipate, remember
from cohaptic_server.world.loads import contact_axes
from cohaptic_server.world.state import NOTHING, Anticipation, Carried, TickTime, UserState
from cohaptic_server.world.users import Applied, Tracked
from tests.server.touches import contact_at, side, touch, user_of
from tests.server.touches import tracked_of as arrays_of
from tests.server.world.worlds import DT

seeds = st.integers(0, 2**32 - 1)


def tracked_of(
    body: Balloon, forces: Floats, ticks: list[int], frictional: tuple[int, ...] = ()
) -> Tracked:
    """Users round the balloon who press with these forces."""
    users: list[UserState] = []
    for i, (force, tick) in enumerate(zip(forces.tolist(), ticks, strict=True)):
        of = touch(i + 1, at=side(0.9 * i), tick=tick, friction=i in frictional)
        along = np.zeros(3) if i in frictional else None
        users.append(user_of(of, contact_at(body, of), requested=force, requested_tangential=along))
    return arrays_of(users)


def plan_for(tracked: Tracked, part: Floats) -> Anticipation:
    """Of all users, each with its normal."""
    n = len(part)
    numbers = np.array([touch.user for touch in tracked.touches])
    solve = np.asarray(np.linalg.inv(np.eye(n) + part), dtype=np.float64)
    return Anticipation(numbers, np.arange(n), tracked.contacts.normals.copy(), part, solve)


def carried_of(tracked: Tracked, forces: Floats) -> tuple[Carried, ...]:
    """Ticks 1, 2, ... in which the body carried these normal forces, shape (ticks, n)."""
    past: tuple[Carried, ...] = ()
    for tick, force in enumerate(forces, start=1):
        applied = Applied(np.ones(len(force)), force, np.zeros((len(force), 3)))
        past = remember(past, TickTime(tick, tick * DT, DT, DT), tracked, applied, 100)
    return past


@given(seeds, st.integers(2, 5))
def test_forces_that_answer_different_ticks_give_the_equilibrium_at_once(
    small_balloon: Balloon, seed: int, n: int
) -> None:
    """f_i = d_i - sum_j S_ij u_j(t_i), each with a tick of its own, and all of S anticipated."""
    rng = np.random.default_rng(seed)
    S = 0.5 * rng.uniform(0.0, 1.0, (n, n)) / n
    np.fill_diagonal(S, 0.0)
    u = rng.uniform(0.0, 2.0, (6, n))
    ticks: list[int] = rng.integers(1, 7, n).tolist()
    d = rng.uniform(4.0, 6.0, n)
    f = d - np.array([S[i] @ u[tick - 1] for i, tick in enumerate(ticks)])
    tracked = tracked_of(small_balloon, f, ticks)
    found, along = anticipate(
        plan_for(tracked, S), carried_of(tracked, u), tracked, f, tracked.tangential
    )
    assert found == pytest.approx(np.linalg.solve(np.eye(n) + S, d), abs=1e-9)
    assert (along == 0.0).all()


@given(seeds, st.integers(2, 5))
def test_at_rest_it_changes_nothing_whatever_is_believed_of_the_coupling(
    small_balloon: Balloon, seed: int, n: int
) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    f = rng.uniform(0.1, 5.0, n)
    tracked = tracked_of(small_balloon, f, [2] * n)
    past = carried_of(tracked, np.tile(f, (3, 1)))
    found, _ = anticipate(plan_for(tracked, A @ A.T), past, tracked, f, tracked.tangential)
    assert found == pytest.approx(f, abs=1e-9)


def test_no_device_is_taken_to_give_more_than_it_can(small_balloon: Balloon) -> None:
    """The others let go, and the surface would press with 11.5 N; the device gives 10."""
    f = np.array([9.0, 0.01, 0.01])
    tracked = tracked_of(small_balloon, f, [1, 1, 1])
    S = 0.5 * (np.ones((3, 3)) - np.eye(3))
    past = carried_of(tracked, np.array([[9.0, 5.0, 5.0]]))
    found, _ = anticipate(plan_for(tracked, S), past, tracked, f, tracked.tangential)
    assert found[0] == tracked.settings[0, 0] == 10.0


def test_who_has_left_or_come_stops_it_for_one_tick(small_balloon: Balloon) -> None:
    f = np.array([2.0, 3.0])
    tracked = tracked_of(small_balloon, f, [1, 1])
    S = np.array([[0.0, 0.5], [0.5, 0.0]])
    past = carried_of(tracked, np.zeros((1, 2)))
    alone = tracked_of(small_balloon, f[:1], [1])
    plan = plan_for(tracked, S)
    assert anticipate(plan, past, alone, f[:1], alone.tangential)[0] is not None
    assert (anticipate(plan, past, alone, f[:1], alone.tangential)[0] == f[:1]).all()
    assert (anticipate(plan, (), tracked, f, tracked.tangential)[0] == f).all()
    assert (anticipate(NOTHING, past, tracked, f, tracked.tangential)[0] == f).all()
    # A third, whom the plan does not know, is left alone; a force of nobody's counts as none.
    more = np.array([2.0, 3.0, 5.0])
    three = tracked_of(small_balloon, more, [1, 1, 1])
    found, _ = anticipate(plan, carried_of(alone, np.ones((1, 1))), three, more, three.tangential)
    assert found[2] == 5.0
    difference = S @ (f - np.array([1.0, 0.0]))
    assert found[:2] == pytest.approx(f - plan.solve @ difference)


def test_a_rough_finger_is_anticipated_along_the_surface_too(small_balloon: Balloon) -> None:
    f = np.array([2.0, 2.0])
    tracked = tracked_of(small_balloon, f, [1, 1], frictional=(1,))
    normals = tracked.contacts.normals
    axes = np.concatenate([normals[:1], contact_axes(normals[1])])
    part = np.zeros((4, 4))
    part[2, 0] = part[0, 2] = 0.4  # the first one's push drags the other sideways
    inverse = np.asarray(np.linalg.inv(np.eye(4) + part), dtype=np.float64)
    plan = Anticipation(np.array([1, 2]), np.array([0, 1, 1, 1]), axes, part, inverse)
    past = carried_of(tracked, np.array([[1.0, 2.0]]))
    found, along = anticipate(plan, past, tracked, f, tracked.tangential)
    change = -plan.solve @ (part @ np.array([1.0, 0.0, 0.0, 0.0]))
    assert found == pytest.approx([2.0 + change[0], 2.0])
    assert along[1] == pytest.approx(change[2] * axes[2])
    assert (along[0] == 0.0).all()
