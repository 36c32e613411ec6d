"""A body beyond the linear finds its equilibrium, a bounded piece of the way at a time.

Newton's method on  E(x) - push . x  over the positions that the body allows. A step that does not
lower the energy is shortened, so that the energy alone says whether it was a good one: it never
rises. The tangent that a tick ends with starts the next one, so that a tick of a hand in motion
costs one or two factorisations and one of a hand at rest none.

Where the tangent is indefinite (a body under a load that it cannot carry, on its way to another
shape) steps are taken with a stiffened one, which still goes down. The last stable tangent is kept
for what others are told: the stiffened one would understate the compliance, which is the unsafe
side (science 3.3), and a tangent on its way to indefinite overstates it.

What an `Elastic` is made of (`watered_sheet.py`, `rubber_tetrahedra.py`) is not known here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints

MAX_MOVE = 0.02  # m of any vertex in a tick; at 60 Hz a hand of 1.2 m/s
STEPS = 2  # in a tick, each with a new tangent
CHORD = 2e-4  # m; a step this short needs no new tangent: what it misses is micrometres
SETTLED = 1e-10  # m; a step this short is none
_TRIES = 6  # lengths of a step
_SHORTER = 0.4
_GAIN = 1e-4  # least part of the energy that the slope promises (Armijo)


class Unstable(BodyError):
    """A tangent is not positive definite on the motions that the body allows."""


class State(Protocol):
    """A deformed body, not always in equilibrium."""

    @property
    def x(self) -> Floats:
        """Positions, shape (n, 3) [m]."""
        ...

    @property
    def energy(self) -> float:
        """Stored [J]."""
        ...


class Solver(Protocol):
    """A factored tangent."""

    def displacements(self, b: Floats) -> Floats:
        """Of the unknowns, shape (c, size) [m], under forces `b` (c, size) [N]."""
        ...


S = TypeVar("S", bound=State)


class Elastic(Protocol[S]):
    """What settles."""

    @property
    def dof(self) -> Ints:
        """Unknowns in the order of its solvers, shape (size,), as indices into (3 n,)."""
        ...

    @property
    def stiffened(self) -> tuple[float, ...]:
        """Measures of stiffening to try in turn where the tangent is indefinite."""
        ...

    def moved(self, state: S, step: Floats, push: Floats) -> S | None:
        """The state after a step (n, 3) [m], of those allowed; None if there is none."""
        ...

    def unbalanced(self, state: S, push: Floats) -> Floats:
        """What of the loads `push` (n, 3) the body does not balance, shape (n, 3) [N]."""
        ...

    def factored(self, state: S, stiffening: float) -> Solver:
        """The tangent, true if `stiffening` is 0; raises `Unstable`."""
        ...


@dataclass(frozen=True, eq=False)
class Tangent:
    """A factored tangent.

    Args:
        x: Where it was taken, shape (n, 3) [m].
        solver: Of it.
        stable: Whether it is the true one; else it was stiffened.
    """

    x: Floats
    solver: Solver
    stable: bool


@dataclass(frozen=True, eq=False)
class Settled(Generic[S]):
    """Where a tick came to.

    Args:
        state: The body.
        tangent: The newest.
        stable: The newest stable one.
        step: What is still to go, greatest component of the next Newton step [m].
    """

    state: S
    tangent: Tangent
    stable: Tangent
    step: float


@dataclass(frozen=True, slots=True)
class Pace:
    """How far a tick goes.

    Args:
        steps: With a new tangent each.
        move: Most that any vertex moves [m].
        chord: Steps shorter than this need no new tangent [m].
    """

    steps: int = STEPS
    move: float = MAX_MOVE
    chord: float = CHORD


class Settling(Generic[S]):
    """The ticks of one body.

    Args:
        body: What settles.
        pace: How far a tick goes.
    """

    def __init__(self, body: Elastic[S], pace: Pace | None = None) -> None:
        self._body, self._pace = body, pace or Pace()

    def at_rest(self, state: S) -> Settled[S] | None:
        """A state in equilibrium, for the first tick to start from; None if it is not stable."""
        tangent = self._tangent(state, (0.0,))
        return None if tangent is None else Settled(state, tangent, tangent, 0.0)

    def settle(self, start: Settled[S], push: Floats) -> Settled[S]:
        """One tick's way towards equilibrium.

        Args:
            start: Where the last one came to.
            push: Loads, shape (n, 3) [N].
        """
        body, chord = self._body, self._pace.chord
        state, tangent = start.state, start.tangent
        length = 0.0
        for last in (*[False] * self._pace.steps, True):
            step, slope = self._step(tangent, body.unbalanced(state, push))
            length = float(np.abs(step).max())
            if length < chord and tangent.stable:
                if length > SETTLED:
                    state = body.moved(state, step, push) or state
                # In motion the tangent is this far behind at most, at rest it is of exactly here.
                allowed = chord if length > SETTLED else 0.0
                if np.abs(state.x - tangent.x).max() > allowed:
                    tangent = self._tangent(state) or tangent
                break
            if last:
                break
            moved = self._search(state, step, start.state, push, slope)
            if moved is None:
                # Too long a step, of a tangent next to singular: a stiffened one in the next tick.
                if tangent.stable or tangent.x is not state.x:
                    tangent = self._tangent(state, body.stiffened) or tangent
                break
            state = moved
            tangent = self._tangent(state) or replace(tangent, stable=False)
            if not tangent.stable:
                break  # it took several factorisations
        return Settled(state, tangent, tangent if tangent.stable else start.stable, length)

    def fields(self, tangent: Tangent, shares: Floats) -> Floats:
        """Displacement of every vertex per unit of each load, shapes (c, n, 3) [m/N]."""
        fields = np.zeros_like(shares)
        c, dof = len(shares), self._body.dof
        if c:
            fields.reshape(c, -1)[:, dof] = tangent.solver.displacements(
                shares.reshape(c, -1)[:, dof]
            )
        return fields

    def _step(self, tangent: Tangent, unbalanced: Floats) -> tuple[Floats, float]:
        """Newton's step (n, 3) [m], and how steep it goes down [J]."""
        step = self.fields(tangent, unbalanced[None])[0]
        return step, float((unbalanced * step).sum())

    def _search(self, state: S, step: Floats, start: S, push: Floats, slope: float) -> S | None:
        """The longest step of some that lowers the energy; None where none does."""
        left = self._pace.move - float(np.abs(state.x - start.x).max())
        length = min(1.0, max(0.0, left) / max(float(np.abs(step).max()), 1e-300))
        now = under(state, push)
        for _ in range(_TRIES):
            moved = self._body.moved(state, length * step, push)
            if moved is not None and under(moved, push) <= now - _GAIN * length * slope:
                return moved
            length *= _SHORTER
        return None

    def _tangent(self, state: S, measures: tuple[float, ...] | None = None) -> Tangent | None:
        """Factored, stiffened as little of `measures` as it takes; None if nothing helped."""
        for measure in (0.0, *self._body.stiffened) if measures is None else measures:
            try:
                solver = self._body.factored(state, measure)
            except Unstable:
                continue
            return Tangent(state.x, solver, stable=measure == 0.0)
        return None


def under(state: State, push: Floats) -> float:
    """Energy of a body and of the loads on it [J]."""
    return state.energy - float((push * state.x).sum())
