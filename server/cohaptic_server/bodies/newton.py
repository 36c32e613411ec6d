"""Equilibrium of a hyperelastic body, tick by tick, and the free surfaces of its users.

Each tick takes a few steps of Newton's method, which minimises  E(x) - external . x,  the stored
energy E less the work of the external forces, over the positions x that the body allows
(`hyperelastic.py`). A step that does not lower this energy enough is shortened (Armijo's rule), so
that the energy never rises. The tangent at the end of a tick starts the next tick: a tick with a
moving hand costs one or two factorisations, a tick with a resting hand none.

If the tangent is indefinite (a body under a load that it cannot carry, on its way to another
shape), the iteration steps with a stiffened tangent, which still gives a descent direction. The
compliance then comes from the last stable tangent: a stiffened tangent would understate the
compliance, which is unsafe (science 3.3). A stable tangent that is about to become indefinite is
nearly singular and overstates the compliance: 3,000 times the compliance at rest was seen, which
put the surface without a finger's force 68 m away. Such a tangent is used for a step, but not for
the compliance.

A user's free surface is the one without that user's own forces (science 3.12). On a linear body it
does not depend on those forces. Under finite deformation it does: u - C f, with the displacement u
and the compliance C of the deformed body, bends as the user's force f grows. A pressing finger then
turns its own contact, receives the turn a loop delay later, and swings. Therefore a user's free
surface also leaves out a part of the displacement beyond the tangent, r = u - (sum of C f over all
loads): the part is the user's share of the dent at each vertex. The free surface of a single user
is the resting surface. The surface is then shifted as a whole along the force, so that in this
direction the contact point stays at u - C f: this is the step of Newton's method, which any other
position would spoil.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Generic

import numpy as np

from cohaptic_server.bodies.body import DenseResponse, Load
from cohaptic_server.bodies.hyperelastic import (
    Hyperelastic,
    IndefiniteTangentError,
    S,
    TangentSolver,
    total_energy,
)
from cohaptic_server.numeric import Floats, Ints

MAX_MOVE = 0.02  # m; limit of a vertex's motion per axis in a tick, a hand of 1.2 m/s at 60 Hz
MAX_STEPS = 2  # steps in a tick, each followed by a new tangent
# m; after a step shorter than this, the tangent is not renewed while the body is within this
# distance of the tangent's positions: the error is micrometres.
CHORD = 2e-4
CONVERGED = 1e-10  # m; a shorter step is not taken
_TRIALS = 6  # number of step lengths that the line search tries
_BACKTRACK = 0.4  # factor from one of these lengths to the next
# A tangent is trusted up to this ratio of a load's compliance to its compliance on the body at
# rest. In sessions on rubber the ratio was 0.8 to 1.7 in 99 of 100 ticks; a thin part that is bent
# round may have a few times more.
SOFTENING = 8.0
_LOOKED_AT = 2.0  # growth over `Iterate.believed` that causes a comparison with the body at rest
_ARMIJO = 1e-4  # least accepted share of the energy decrease that the slope predicts


@dataclass(frozen=True, eq=False)
class Tangent:
    """The factored tangent of a body at some positions.

    Args:
        x: Positions of the nodes, shape (n, 3) [m].
        solver: Factor of the tangent.
        stable: True for the exact tangent; False for a stiffened tangent, or one whose renewal
            failed.
    """

    x: Floats
    solver: TangentSolver
    stable: bool


@dataclass(frozen=True, eq=False)
class Iterate(Generic[S]):
    """State of the iteration at the end of a tick.

    Args:
        state: The deformed body.
        tangent: The newest tangent.
        stable: The newest stable tangent whose compliance is trusted.
        next_step: Largest component of the last Newton step that was computed [m].
        believed: Largest compliance that passed the comparison with the body at rest [m/N].
    """

    state: S
    tangent: Tangent
    stable: Tangent
    next_step: float
    believed: float = 0.0


@dataclass(frozen=True, eq=False)
class Solved:
    """A new tangent with the displacements that were computed when it was factored.

    Args:
        tangent: The factored tangent.
        step: Newton step from the positions of the tangent, shape (n, 3) [m].
        fields: Displacement of every node per unit force of each load, shape (c, n, 3) [m/N].
    """

    tangent: Tangent
    step: Floats
    fields: Floats


@dataclass(frozen=True, eq=False)
class Moved(Generic[S]):
    """The result of the iteration in one tick.

    Args:
        iterate: State of the iteration at the end of the tick.
        fields: Displacement of every node per unit force of each load, from the newest stable
            tangent that is trusted, shape (c, n, 3) [m/N].
    """

    iterate: Iterate[S]
    fields: Floats


@dataclass(frozen=True, slots=True)
class TickLimits:
    """Limits of the iteration within one tick.

    Args:
        steps: Largest number of steps, each followed by a new tangent.
        move: Largest displacement of any vertex along an axis [m].
        chord: Length of a step, and distance from the tangent's positions, up to which the tangent
            is not renewed [m].
    """

    steps: int = MAX_STEPS
    move: float = MAX_MOVE
    chord: float = CHORD


class NewtonIteration(Generic[S]):
    """The Newton iteration of one body, tick by tick.

    Args:
        body: The hyperelastic body.
        limits: Limits of the iteration within a tick; None takes the defaults.
    """

    def __init__(self, body: Hyperelastic[S], limits: TickLimits | None = None) -> None:
        self._body, self._limits = body, limits or TickLimits()

    def at_rest(self, state: S) -> Iterate[S] | None:
        """Return the iteration at an equilibrium; None if the equilibrium is not stable.

        Args:
            state: The body in equilibrium without external forces.
        """
        nothing = np.zeros_like(state.x)
        solved = self._solved(state, nothing, nothing[None][:0], (0.0,))
        return None if solved is None else Iterate(state, solved.tangent, solved.tangent, 0.0)

    def advance(
        self, start: Iterate[S], external: Floats, fractions: Floats, rest: Iterate[S]
    ) -> Moved[S]:
        """Take the steps of one tick towards equilibrium.

        Args:
            start: Iteration at the end of the previous tick.
            external: Nodal forces of the contacts, shape (n, 3) [N].
            fractions: Nodal forces of each load per unit of its force, shape (c, n, 3).
            rest: Iteration of the body at rest.
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
                # The tangent of a moving body may lag by a chord; at rest the tangent is renewed.
                allowed = chord if length > CONVERGED else 0.0
                if np.abs(state.x - tangent.x).max() > allowed:
                    solved = self._solved(state, external, fractions) or solved
                    tangent = tangent if solved is None else solved.tangent
                break
            if last:
                break
            # Decrease of energy that the full step promises to first order.
            slope = float((residual * step).sum())
            displaced = self._search(state, step, start.state, external, slope)
            if displaced is None:
                # The tangent is nearly singular and its step too long: stiffen the next tangent.
                if tangent.stable or tangent.x is not state.x:
                    solved = self._solved(state, external, fractions, body.stiffenings) or solved
                    tangent = tangent if solved is None else solved.tangent
                break
            state = displaced
            solved = self._solved(state, external, fractions)
            tangent = replace(tangent, stable=False) if solved is None else solved.tangent
            if not tangent.stable:
                break  # stiffening took several factorisations
        stable = tangent if tangent.stable else start.stable
        if solved is not None and solved.tangent is stable:
            fields = solved.fields
        else:
            fields = self.fields(stable, fractions)
        stable, fields, believed = self._believed(stable, fields, fractions, start, rest)
        return Moved(Iterate(state, tangent, stable, length, believed), fields)

    def _believed(
        self,
        stable: Tangent,
        fields: Floats,
        fractions: Floats,
        start: Iterate[S],
        rest: Iterate[S],
    ) -> tuple[Tangent, Floats, float]:
        """Return the tangent for the compliance, its fields and the new `Iterate.believed`.

        The compliances are compared with those of the tangent at rest. The comparison costs a
        solve, and is made only if a compliance has grown well beyond `start.believed`.
        """
        own = _own_compliance(fields, fractions)
        if own.max(initial=0.0) <= _LOOKED_AT * start.believed:
            return stable, fields, start.believed
        at_rest = self.fields(rest.stable, fractions)
        limit = SOFTENING * _own_compliance(at_rest, fractions)
        if (own > limit).any():
            stable = start.stable
            fields = self.fields(stable, fractions)
            own = _own_compliance(fields, fractions)
            if (own > limit).any():
                return rest.stable, at_rest, start.believed
        return stable, fields, max(start.believed, float(own.max()))

    def fields(self, tangent: Tangent, fractions: Floats) -> Floats:
        """Return the displacement of every node per unit force of each load.

        Args:
            tangent: Tangent with which to solve.
            fractions: Nodal forces of each load per unit of its force, shape (c, n, 3).

        Returns:
            Fields of the loads, shape (c, n, 3) [m/N].
        """
        if not len(fractions):
            return np.zeros_like(fractions)
        return self._spread(tangent.solver.displacements(self._unknown(fractions)), fractions)

    def _step(self, tangent: Tangent, residual: Floats) -> Floats:
        """Return the Newton step under the forces `residual`, shape (n, 3) [m]."""
        force = residual[None]
        return np.asarray(self._spread(tangent.solver.step(self._unknown(force)), force)[0])

    def _unknown(self, forces: Floats) -> Floats:
        """Return the values of the unknowns among nodal values (c, n, 3), shape (c, size)."""
        return np.asarray(forces.reshape(len(forces), -1)[:, self._body.dof])

    def _spread(self, values: Floats, like: Floats) -> Floats:
        """Return nodal values, in the shape of `like`, of the unknowns; 0 at fixed nodes."""
        spread = np.zeros_like(like)
        spread.reshape(len(like), -1)[:, self._body.dof] = values
        return spread

    def _search(self, state: S, step: Floats, start: S, external: Floats, slope: float) -> S | None:
        """Return the state after the longest tried step that lowers the energy enough, or None."""
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
        fractions: Floats,
        stiffenings: tuple[float, ...] | None = None,
    ) -> Solved | None:
        """Factor with the least stiffening that makes the tangent definite; None if none does."""
        forces = np.concatenate([self._body.residual(state, external)[None], fractions])
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


def _own_compliance(fields: Floats, fractions: Floats) -> Floats:
    """Return the displacement of each load's contact along its unit force, shape (c,) [m/N]."""
    return np.asarray(np.einsum("cni,cni->c", fractions, fields))


# m; in a dent far smaller than this the shares of all users are near 0, so that no share jumps when
# a force begins.
_NO_DENT = 1e-6


@dataclass(frozen=True, eq=False)
class FiniteResponse(DenseResponse):
    """A response whose displacement is not the sum of its fields times forces.

    Args:
        loads: Loads that caused the response.
    """

    loads: Sequence[Load]

    def without_own(self, spans: Ints, forces: Floats, starts: Ints, vertices: Ints) -> Floats:
        """Return each user's free surface at some vertices, shape (k, 3) [m].

        The surface is without the user's loads, and without the user's part of r (the displacement
        beyond the tangent, see the module's head).

        Args:
            spans: First load of each of n users, then the end of the last user's loads, (n + 1,).
            forces: Forces to subtract from these loads [N].
            starts: Start of each user's part of `vertices`, and the end of the last one, (n + 1,).
            vertices: Vertices at which the displacement is computed, user after user, shape (k,).
        """
        left = super().without_own(spans, forces, starts, vertices)
        users = zip(pairwise(spans.tolist()), pairwise(starts.tolist()), strict=True)
        for (first, last), (a, b) in users:
            if first < last and a < b:
                left[a:b] -= self._own_beyond_tangent(first, last, vertices[a:b])
        return left

    def _own_beyond_tangent(self, first: int, last: int, vertices: Ints) -> Floats:
        """Return a user's part of r, less its motion of the contact along the force, (k, 3) [m].

        Args:
            first, last: Index of the user's first load, which acts along the normal, and the index
                after the user's last load.
            vertices: Vertices at which the part is computed, shape (k,).
        """
        load = self.loads[first]
        every = np.concatenate([vertices, load.vertices])
        forces = np.array([one.force for one in self.loads])
        dents = forces[:, None, None] * self.fields[:, every]
        own, tangent = dents[first:last].sum(axis=0), dents.sum(axis=0)
        mine, others = (own**2).sum(axis=1), ((tangent - own) ** 2).sum(axis=1)
        fraction = mine / (mine + others + _NO_DENT**2)
        part = fraction[:, None] * (self.displacement[every] - tangent)
        contact = load.weights @ part[len(vertices) :]
        return np.asarray(part[: len(vertices)] - (contact @ load.direction) * load.direction)
