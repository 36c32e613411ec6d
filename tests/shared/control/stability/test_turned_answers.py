from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.stability.anticipation import (
    HAND_DAMPING,
    HAND_MASS,
    Gains,
    Part,
    anticipated,
    gains_left,
    lag_of_hands,
)
from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.planning import lag_where_turned
from tests.examples_of_laws import examples

seeds = st.integers(0, 2**32 - 1)


class Limb(NamedTuple):
    """Hands on a body that is soft along its surface: S_pp, S_pt and S_tt."""

    S: Floats
    across: Floats
    along: Floats

    @property
    def root(self) -> Floats:
        """V = S_pt (1 - S_tt)^(-1/2)."""
        values, vectors = np.linalg.eigh(self.along)
        return np.asarray(self.across @ (vectors / np.sqrt(1.0 - values)))

    @property
    def part(self) -> Part:
        return anticipated(self.S + self.root @ self.root.T)

    @property
    def late(self) -> float:
        """q T_b, in ticks."""
        longest = float(np.abs(np.linalg.eigvalsh(self.along)).max())
        norms = np.linalg.norm(self.root, 2) * np.linalg.norm(self.root.T @ self.part.solve, 2)
        return float(norms) / (1.0 - longest)


def limb(rng: np.random.Generator, n: int) -> Limb:
    A = rng.standard_normal((3 * n, 3 * n + 2))
    C = A @ A.T + 4.0 * n * np.ones((3 * n, 3 * n))
    soft = np.where(np.arange(3 * n) < n, 1.0, rng.uniform(1.0, 3.0))
    C *= np.outer(soft, soft)
    g = np.repeat(rng.uniform(0.0, 1.0, n), 2)
    own = np.diag(C)[:n]
    root = np.concatenate([1.0 / np.sqrt(own), np.sqrt(g / np.repeat(own, 2))])
    S = C * np.outer(root, root)
    owner = np.concatenate([np.arange(n), np.repeat(np.arange(n), 2)])
    S[owner[:, None] == owner] = 0.0
    along = S[n:, n:]
    along = along * min(1.0, 0.6 / max(1e-9, float(np.linalg.eigvalsh(along)[-1])))
    return Limb(S[:n, :n], S[:n, n:], along)


def growth(room: Limb, ticks: list[int], tau: float) -> float:
    """Largest modulus of an eigenvalue of the sampled room, of held hands with these delays.

    Contacts turn by the surface of the tick before, one step of S_tt in each tick. The lag `tau` is
    the implicit one of science 3.8, in ticks.
    """
    n, memory = len(room.S), max(ticks) + 2
    part = room.part
    states = 3 * n * memory
    step = np.zeros((states, states))
    u = [slice(k * n, (k + 1) * n) for k in range(memory)]
    t = [slice((memory + 2 * k) * n, (memory + 2 * k + 2) * n) for k in range(memory)]
    answers = np.zeros((n, states))
    for i, late in enumerate(ticks):
        answers[i, u[late]] += part.X[i] - room.S[i]
        answers[i, t[late]] -= room.across[i]
    fraction = 1.0 / (1.0 + tau)
    step[u[0]] = fraction * (part.solve @ answers)
    step[u[0], u[0]] += (1.0 - fraction) * np.eye(n)
    step[t[0], t[0]] = room.along
    step[t[0], u[0]] = room.across.T
    for before, after in itertools.pairwise(range(memory)):
        step[u[after], u[before]] = np.eye(n)
        step[t[after], t[before]] = np.eye(2 * n)
    return float(np.abs(np.linalg.eigvals(step)).max())


@given(seeds, st.integers(2, 4), st.data())
@settings(max_examples=examples(40))
def test_held_hands_rest_behind_the_lag_at_any_unequal_delays(
    seed: int, n: int, data: st.DataObject
) -> None:
    """3.13 (d) for hands held still: tau = q T_b / (1 - c^2)^(1/2)."""
    room = limb(np.random.default_rng(seed), n)
    ticks = data.draw(st.lists(st.integers(0, 8), min_size=n, max_size=n))
    tau = room.late / (1.0 - room.part.gains.held**2) ** 0.5
    assert growth(room, ticks, tau) < 1.0


def test_without_the_lag_nearly_all_of_these_rooms_swing() -> None:
    """So the test above can fail: a contact that turns a tick late is enough."""
    rooms = [limb(np.random.default_rng(seed), 2 + seed % 3) for seed in range(20)]
    assert sum(growth(room, [3] * len(room.S), 0.0) > 1.0 for room in rooms) > 15


@given(seeds, st.integers(2, 6))
def test_what_turned_contacts_answer_makes_no_room_tighter(seed: int, n: int) -> None:
    room = limb(np.random.default_rng(seed), n)
    lowest = np.linalg.eigvalsh(room.S)[0]
    assert np.linalg.eigvalsh(room.S + room.root @ room.root.T)[0] >= lowest - 1e-9


gains = st.builds(gains_left, st.floats(0.0, 60.0), st.floats(-0.99, 0.0))


@given(gains, st.floats(0.0, 8.0), st.floats(1.0, 5000.0), st.floats(1e-4, 0.2))
def test_it_is_no_less_than_without_turning_and_grows_with_what_is_late(
    room: Gains, damping: float, stiffest: float, late: float
) -> None:
    without = lag_of_hands(room, damping, stiffest)
    lags = [lag_where_turned(room, damping, stiffest, late * k) for k in (0.0, 0.5, 1.0)]
    assert lags[0] >= without
    assert lags == sorted(lags)
    assert lags[2] >= late / (1.0 - room.held**2) ** 0.5


@given(gains, st.floats(5.0, 2000.0), st.floats(0.0, 0.1), st.floats(0.02, 0.5), seeds)
def test_no_hand_has_more_gain_in_its_row_than_the_lag_takes(
    room: Gains, K: float, late: float, mass: float, seed: int
) -> None:
    """Hands of up to theta times their damping, of any stiffness, at any frequency."""
    damping, rng = HAND_DAMPING + 8.0, np.random.default_rng(seed)
    tau = lag_where_turned(room, 8.0, K, late)
    # Lightest first: mass over damping is at most theta.
    M, b = min(mass, HAND_MASS), damping * float(rng.uniform(1.0, 4.0))
    k = float(rng.choice([0.0, rng.uniform(0.0, 1000.0)]))
    w = np.geomspace(0.3, 300.0, 200)
    hand = -M * w * w + 1j * b * w + k
    H = hand / (hand + K)
    row = np.hypot(np.abs(1.0 - H) * room.together, np.abs(-(1.0 - H) * room.apart + H * room.held))
    row = row + np.abs(H) * late * w
    assert (row <= np.hypot(1.0, w * tau) * (1.0 + 5e-3)).all()
