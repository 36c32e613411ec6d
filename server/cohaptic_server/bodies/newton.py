"""Newton iteration of a hyperelastic body towards equilibrium, a bounded part of it in each tick.

Newton's method minimises  E(x) - external . x  over the positions that the body allows. A step that
does not lower this energy enough is shortened (Armijo's rule), so that the energy never rises. The
tangent at the end of a tick starts the next one: a tick of a moving hand costs one or two
factorisations, one of a resting hand none.

Where the tangent is indefinite (a body under a load that it cannot carry, on its way to another
shape) steps are taken with a stiffened tangent, which is still a descent direction. The last
stable tangent is kept for the compliance: the stiffened one would understate it, which is
the unsafe side (science 3.3), and one that turns indefinite overstates it. Just before it turns it
is all but singular: 3,000 times the compliance at rest was seen, by which the surface without a
finger's force lay 68 m away. Such a tangent is good for a step, and not for the compliance either.

The body itself is behind the `Hyperelastic` Protocol.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from cohaptic_server.bodies.hyperelastic import (
    Hyperelastic,
    IndefiniteTangentError,
    S,
    TangentSolver,
    total_energy,
)
from cohaptic_server.numeric import Floats

MAX_MOVE = 0.02  # m of any vertex in a tick; at 60 Hz a hand of 1.2 m/s
MAX_STEPS = 2  # in a tick, each followed by a new tangent
CHORD = 2e-4  # m; after so short a step the old tangent is kept: its error is micrometres
CONVERGED = 1e-10  # m; a shorter step is not taken
_TRIALS = 6  # lengths of a step that the line search tries
_BACKTRACK = 0.4  # factor from one of these lengths to the next
# Times the compliance of the body at rest that a tangent may give to a load. In sessions on rubber
# 99 of 100 ticks had 0.8 to 1.7 times; a thin part that is bent round may have a few times more.
SOFTENING = 8.0
_LOOKED_AT = 2.0  # times what was believed before, from which it is compared with that at rest
_ARMIJO = 1e-4  # least share of the decrease that the slope predicts


@dataclass(frozen=True, eq=False)
class Tangent:
    """A factored tangent.

    Args:
        x: Positions at which it was taken, shape (n, 3) [m].
        solver: Its factor.
        stable: Whether it is the exact one; otherwise it was stiffened.
    """

    x: Floats
    solver: TangentSolver
    stable: bool


@dataclass(frozen=True, eq=False)
class Iterate(Generic[S]):
    """The iteration at the end of a tick.

    Args:
        state: The body.
        tangent: The newest tangent.
        stable: The newest stable tangent whose compliance is believed.
        next_step: Largest component of the next Newton step [m].
        believed: Largest compliance that was compared with that at rest and believed [m/N].
    """

    state: S
    tangent: Tangent
    stable: Tangent
    next_step: float
    believed: float = 0.0


@dataclass(frozen=True, eq=False)
class Solved:
    """A tangent with what was solved with it when it was made.

    Args:
        tangent: The tangent.
        step: Newton step from where it was taken, shape (n, 3) [m].
        fields: Displacement of every node per unit of each load, shape (c, n, 3) [m/N].
    """

    tangent: Tangent
    step: Floats
    fields: Floats


@dataclass(frozen=True, eq=False)
class Moved(Generic[S]):
    """What a tick finds.

    Args:
        iterate: The iteration at its end.
        fields: Displacement of every node per unit of each load, of the newest stable tangent that
            is believed, shape (c, n, 3) [m/N].
    """

    iterate: Iterate[S]
    fields: Floats


@dataclass(frozen=True, slots=True)
class TickLimits:
    """Limits of the iteration within one tick.

    Args:
        steps: Steps with a new tangent each.
        move: Largest displacement of any vertex [m].
        chord: Steps shorter than this keep the tangent [m].
    """

    steps: int = MAX_STEPS
    move: float = MAX_MOVE
    chord: float = CHORD


class NewtonIteration(Generic[S]):
    """The Newton iteration of one body, tick by tick.

    Args:
        body: Energy, residual and tangent.
        limits: Limits of a tick; the defaults if not given.
    """

    def __init__(self, body: Hyperelastic[S], limits: TickLimits | None = None) -> None:
        self._body, self._limits = body, limits or TickLimits()

    def at_rest(self, state: S) -> Iterate[S] | None:
        """A state of equilibrium as the start of the first tick; None if it is not stable."""
        nothing = np.zeros_like(state.x)
        solved = self._solved(state, nothing, nothing[None][:0], (0.0,))
        return None if solved is None else Iterate(state, solved.tangent, solved.tangent, 0.0)

    def advance(
        self, start: Iterate[S], external: Floats, shares: Floats, rest: Iterate[S]
    ) -> Moved[S]:
        """Iterate for one tick.

        Args:
            start: End of the previous tick.
            external: Nodal forces of the contacts, shape (n, 3) [N].
            shares: Nodal forces of each load per unit of its force, shape (c, n, 3).
            rest: The body at rest.
        """
        body, chord = self._body, self._limits.chord
        state, tangent = start.state, start.tangent
        solved: Solved | None = None
        length = 0.0
        for last in (*[False] * self._limits.steps, True):
            residual = body.residual(state, external)
            step = self._step(tangent, residual) if solved is None else solved.step
            length = float(np.abs(step).max())
            if length < chord and tangent.stable:
                if length > CONVERGED:
                    state = body.displaced(state, step, external) or state
                # Of a moving body the tangent may be a chord behind; at rest it is renewed.
                allowed = chord if length > CONVERGED else 0.0
                if np.abs(state.x - tangent.x).max() > allowed:
                    solved = self._solved(state, external, shares) or solved
                    tangent = tangent if solved is None else solved.tangent
                break
            if last:
                break
            # The decrease of energy that the slope predicts.
            slope = float((residual * step).sum())
            displaced = self._search(state, step, start.state, external, slope)
            if displaced is None:
                # The tangent is close to singular and its step too long: stiffen the next one.
                if tangent.stable or tangent.x is not state.x:
                    solved = self._solved(state, external, shares, body.stiffenings) or solved
                    tangent = tangent if solved is None else solved.tangent
                break
            state = displaced
            solved = self._solved(state, external, shares)
            tangent = replace(tangent, stable=False) if solved is None else solved.tangent
            if not tangent.stable:
                break  # it took several factorisations
        stable = tangent if tangent.stable else start.stable
        if solved is not None and solved.tangent is stable:
            fields = solved.fields
        else:
            fields = self.fields(stable, shares)
        stable, fields, believed = self._believed(stable, fields, shares, start, rest)
        return Moved(Iterate(state, tangent, stable, length, believed), fields)

    def _believed(
        self, stable: Tangent, fields: Floats, shares: Floats, start: Iterate[S], rest: Iterate[S]
    ) -> tuple[Tangent, Floats, float]:
        """The tangent for the compliance, its fields, and the compliance that is believed.

        A solution with the tangent at rest tells, asked for only where the compliance has grown.
        """
        own = _own_compliance(fields, shares)
        if own.max(initial=0.0) <= _LOOKED_AT * start.believed:
            return stable, fields, start.believed
        at_rest = self.fields(rest.stable, shares)
        most = SOFTENING * _own_compliance(at_rest, shares)
        if (own > most).any():
            stable = start.stable
            fields = self.fields(stable, shares)
            own = _own_compliance(fields, shares)
            if (own > most).any():
                return rest.stable, at_rest, start.believed
        return stable, fields, max(start.believed, float(own.max()))

    def fields(self, tangent: Tangent, shares: Floats) -> Floats:
        """Displacement of every node per unit of each load.

        Args:
            tangent: The tangent to solve with.
            shares: Nodal forces of each load per unit of its force, shape (c, n, 3).

        Returns:
            Shape (c, n, 3) [m/N].
        """
        if not len(shares):
            return np.zeros_like(shares)
        return self._spread(tangent.solver.displacements(self._unknown(shares)), shares)

    def _step(self, tangent: Tangent, residual: Floats) -> Floats:
        """Newton step, shape (n, 3) [m]."""
        force = residual[None]
        return np.asarray(self._spread(tangent.solver.step(self._unknown(force)), force)[0])

    def _unknown(self, forces: Floats) -> Floats:
        """Nodal values (c, n, 3) as unknowns in their order, shape (c, size)."""
        return np.asarray(forces.reshape(len(forces), -1)[:, self._body.dof])

    def _spread(self, values: Floats, like: Floats) -> Floats:
        """The reverse of `_unknown`, in the shape of `like`."""
        spread = np.zeros_like(like)
        spread.reshape(len(like), -1)[:, self._body.dof] = values
        return spread

    def _search(self, state: S, step: Floats, start: S, external: Floats, slope: float) -> S | None:
        """Backtracking line search; None where no length lowers the energy enough."""
        left = self._limits.move - float(np.abs(state.x - start.x).max())
        length = min(1.0, max(0.0, left) / max(float(np.abs(step).max()), 1e-300))
        energy = total_energy(state, external)
        for _ in range(_TRIALS):
            displaced = self._body.displaced(state, length * step, external)
            if displaced is not None:
                limit = energy - _ARMIJO * length * slope
                if total_energy(displaced, external) <= limit:
                    return displaced
            length *= _BACKTRACK
        return None

    def _solved(
        self,
        state: S,
        external: Floats,
        shares: Floats,
        stiffenings: tuple[float, ...] | None = None,
    ) -> Solved | None:
        """Factor with the least sufficient stiffening; None if no amount suffices."""
        forces = np.concatenate([self._body.residual(state, external)[None], shares])
        b = self._unknown(forces)
        for amount in (0.0, *self._body.stiffenings) if stiffenings is None else stiffenings:
            try:
                solver, found = self._body.factor_tangent(state, amount, b)
            except IndefiniteTangentError:
                continue
            moved = self._spread(found, forces)
            tangent = Tangent(state.x, solver, stable=amount == 0.0)
            return Solved(tangent, moved[0], moved[1:])
        return None


def _own_compliance(fields: Floats, shares: Floats) -> Floats:
    """Displacement of each load per unit of its own force, along it, shape (c,) [m/N]."""
    return np.asarray(np.einsum("cni,cni->c", shares, fields))
