"""Forces of several hands on one body, and models of hands that give way under them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.hand_model import USUAL_HAND, Deflection, HandModel, contact_forces, deflect
from cohaptic.protocol.partners import HEAVIEST, LIGHTEST

Floats = npt.NDArray[np.float64]
MAX_HANDS = 8
ENOUGH = 1e-4  # N; far less than a fingertip feels

sizes = st.integers(1, MAX_HANDS)
seeds = st.integers(0, 2**32 - 1)


class Case:
    """Hands whose contacts share some of their compliance; depths and limits of both signs.

    Attributes:
        C: Positive definite, shape (n, n) [m/N].
        x: Shape (n,) [m].
        limit: Shape (n,) [N].
    """

    def __init__(self, n: int, seed: int, shared: float) -> None:
        """`shared` is the share of all compliance that is common to all contacts, below 1."""
        rng = np.random.default_rng(seed)
        mixed = rng.standard_normal((n, n))
        own = mixed @ mixed.T / n + np.eye(n)
        scale = 10.0 ** rng.uniform(-4.0, -2.0)
        self.C: Floats = scale * ((1.0 - shared) * own + shared * np.ones((n, n)))
        self.x: Floats = rng.uniform(-1.0, 1.0, n) * scale * 10.0
        self.limit: Floats = rng.choice([0.0, 1.0, 3.0, 10.0, 100.0], n)

    def solved(self) -> Floats:
        """The forces, by trial: each hand presses freely, or not at all, or with its most."""
        n = len(self.x)
        best, found = math.inf, np.zeros(n)
        for states in itertools.product((0.0, 0.5, 1.0), repeat=n):
            state = np.array(states)
            free, forces = state == 0.5, np.floor(state) * self.limit
            rest = self.x[free] - self.C[np.ix_(free, ~free)] @ forces[~free]
            forces[free] = np.linalg.solve(self.C[np.ix_(free, free)], rest)
            allowed = (forces >= 0.0).all() and (forces <= self.limit).all()
            if allowed and self.energy(forces) < best:
                best, found = self.energy(forces), forces
        return found

    def wrong(self, forces: Floats) -> float:
        """By how much forces miss what only the solution has: no hand can do better alone [N]."""
        alone = forces + (self.x - self.C @ forces) / np.diag(self.C)
        return float(np.abs(np.clip(alone, 0.0, self.limit) - forces).max())

    def found(self, start: Floats) -> Floats:
        return np.array(
            contact_forces(self.C.tolist(), self.x.tolist(), self.limit.tolist(), start.tolist())
        )

    def energy(self, forces: Floats) -> float:
        return float(0.5 * forces @ self.C @ forces - self.x @ forces)


@given(st.integers(1, 5), seeds, st.floats(0.0, 0.9))
def test_forces_are_those_of_another_solver(n: int, seed: int, shared: float) -> None:
    case, forces = Case(n, seed, shared), np.zeros(n)
    for _ in range(20):
        forces = case.found(forces)
    assert forces == pytest.approx(case.solved(), abs=ENOUGH)


@given(sizes, seeds, st.floats(0.0, 0.9))
def test_nearly_all_of_a_jump_is_in_the_period_of_the_jump(
    n: int, seed: int, shared: float
) -> None:
    case = Case(n, seed, shared)
    first = forces = case.found(np.zeros(n))
    for _ in range(20):
        forces = case.found(forces)
    assert case.wrong(forces) <= ENOUGH
    least = case.energy(forces)
    assert case.energy(first) - least <= 1e-4 * abs(least) + 1e-15


@given(sizes, seeds, st.floats(0.0, 0.999), seeds)
def test_no_period_leaves_forces_worse_or_beyond_their_limits(
    n: int, seed: int, shared: float, of_start: int
) -> None:
    """Whatever it began with, and also where hands share all that yields."""
    case = Case(n, seed, shared)
    start = np.random.default_rng(of_start).uniform(0.0, 1.0, n) * case.limit
    forces = case.found(start)
    assert (forces >= 0.0).all()
    assert (forces <= case.limit).all()
    assert case.energy(forces) <= case.energy(start) + 1e-12


@given(seeds)
def test_the_forces_of_hands_that_press_leave_them_at_the_surface(seed: int) -> None:
    case = Case(4, seed, 0.3)
    case.limit[:] = np.inf
    forces = np.zeros(4)
    for _ in range(20):
        forces = case.found(forces)
    gap = case.C @ forces - case.x
    assert (gap >= -1e-7).all()
    assert np.abs(gap * forces).max() <= 1e-6


@pytest.mark.parametrize("place", ["C", "depth", "limit", "start"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@given(sizes, seeds, st.data())
def test_what_is_no_number_makes_no_force_that_is_none(
    place: str, bad: float, n: int, seed: int, data: st.DataObject
) -> None:
    case = Case(n, seed, 0.2)
    start = np.zeros(n)
    values = {"C": case.C, "depth": case.x, "limit": case.limit, "start": start}[place]
    limits = case.limit.copy()
    index = data.draw(st.integers(0, values.size - 1))
    values.reshape(-1)[index] = bad
    forces = case.found(start)
    if place == "limit":
        limits[index] = max(0.0, bad) if bad == bad else math.inf
    assert np.isfinite(forces).all()
    assert (forces >= 0.0).all()
    assert (forces <= limits).all()
    # And nothing of it is left in the next period.
    if place == "start":
        for _ in range(20):
            forces = case.found(forces)
        assert case.wrong(forces) <= ENOUGH


models = st.builds(
    lambda *fractions: HandModel(
        *(
            low * (high / low) ** s
            for s, low, high in zip(fractions, LIGHTEST, HEAVIEST, strict=True)
        )
    ),
    *[st.sampled_from((0.0, 1.0)) | st.floats(0.0, 1.0)] * 3,
)
periods = st.floats(0.0005, 0.004)  # two periods of the slowest loop


def in_a_period(model: HandModel, dt: float) -> Floats:
    """The matrix of one period without force, on the displacement and dt times the velocity."""
    columns = [
        deflect(deflection, model, 0.0, dt)
        for deflection in (Deflection(1.0, 0.0), Deflection(0.0, 1.0 / dt))
    ]
    return np.array([[deflection.y, dt * deflection.v] for deflection in columns]).T


@given(models, periods)
def test_every_allowed_model_comes_to_rest(model: HandModel, dt: float) -> None:
    # Both limits once more, as 32 bits round them.
    for rounded in (model, HandModel(*[value * (1 + 1e-6) for value in model])):
        assert np.abs(np.linalg.eigvals(in_a_period(rounded, dt))).max() < 1.0


@given(models, periods, st.floats(0.0, 100.0))
def test_a_model_rests_where_its_spring_bears_the_force(
    model: HandModel, dt: float, force: float
) -> None:
    rest = Deflection(force / model.stiffness, 0.0)
    again = deflect(rest, model, force, dt)
    assert again.y == pytest.approx(rest.y, rel=1e-12)
    assert abs(again.v) <= 1e-9 * force


@given(st.floats(1.0, 10.0), st.floats(0.0, 0.01))
def test_the_usual_hand_moves_as_its_equation_says(force: float, start: float) -> None:
    """Against the closed solution of m y'' + b y' + k y = f, within 2 % of its way."""
    m, b, k = USUAL_HAND
    root = complex(-b / (2.0 * m), math.sqrt(k / m - (b / (2.0 * m)) ** 2))
    deflection, rest = Deflection(start, 0.0), force / k
    A, dt = start - rest, 0.0005
    for i in range(1, 601):
        deflection = deflect(deflection, USUAL_HAND, force, dt)
        wave = np.exp(root * i * dt)
        expected = rest + A * (wave.real - root.real / root.imag * wave.imag)
        assert abs(deflection.y - expected) <= 0.02 * abs(A) + 1e-9
