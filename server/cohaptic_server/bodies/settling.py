"""A rubber sheet round water finds its equilibrium, a bounded piece of the way at a time.

Newton's method on  E(x) - push . x  at V(x) = V0  with the base held. A step goes along the surface
of constant volume and is put back onto it, so that the energy alone says whether it was a good
one: it never rises. The tangent that a tick ends with starts the next one, so that a tick of a hand
in motion costs one or two factorisations and one of a hand at rest none.

Where the tangent is indefinite (a balloon under a load that it cannot carry on its way to another
shape) steps are taken with a stiffened one, which still goes down. The last stable tangent is kept
for what others are told: the stiffened one would understate the compliance, which is the unsafe
side (science 3.3), and a tangent on its way to indefinite overstates it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cohaptic_server.bodies.held_water import Band, HeldWater, Unstable
from cohaptic_server.bodies.mesh import Floats, Ints
from cohaptic_server.bodies.sheet import Sheet
from cohaptic_server.bodies.tension_field import Strained

MAX_MOVE = 0.02  # m of any vertex in a tick; at 60 Hz a hand of 1.2 m/s
STEPS = 2  # in a tick, each with a new tangent
CHORD = 2e-4  # m; a step this short needs no new tangent: what it misses is micrometres
SETTLED = 1e-10  # m; a step this short is none
_STIFFENED = (
    0.0,
    0.03,
    1.0,
)  # of the mean diagonal; the last is above what the water can take away
_TRIES = 6  # lengths of a step
_SHORTER = 0.4
_GAIN = 1e-4  # least part of the energy that the slope promises (Armijo)


@dataclass(frozen=True, eq=False)
class State:
    """A surface, not always in equilibrium.

    Args:
        x: Vertices, shape (n, 3) [m].
        strain: Of the rubber.
        energy: Of the rubber [J].
        force: That holds the rubber so, shape (n, 3) [N].
        g: dV/dx, shape (n, 3) [m^2].
    """

    x: Floats
    strain: Strained
    energy: float
    force: Floats
    g: Floats

    def under(self, push: Floats) -> float:
        """Energy of the rubber and of the loads [J]."""
        return self.energy - float((push * self.x).sum())


@dataclass(frozen=True, eq=False)
class Tangent:
    """A factored tangent.

    Args:
        x: Where it was taken, shape (n, 3) [m].
        solver: Of K and the water.
        stable: Whether it is the true one; else it was stiffened.
    """

    x: Floats
    solver: HeldWater
    stable: bool


@dataclass(frozen=True, eq=False)
class Settled:
    """Where a tick came to.

    Args:
        state: The surface.
        pressure: Of the water [Pa].
        tangent: The newest.
        stable: The newest stable one.
        step: What is still to go, greatest component of the next Newton step [m].
    """

    state: State
    pressure: float
    tangent: Tangent
    stable: Tangent
    step: float


class Settling:
    """Sheet, water and base.

    Args:
        sheet: Rubber and water.
        dof: Unknowns in the order of the sheet's pattern, shape (f,), as indices into (3 n,).
        band: Pattern of the tangent.
        volume: Of the water [m^3].
    """

    def __init__(self, sheet: Sheet, dof: Ints, band: Band, volume: float) -> None:
        self._sheet, self._dof, self._band, self._volume = sheet, dof, band, volume
        self._diagonal = np.flatnonzero(sheet.rows == sheet.columns)

    def at_rest(self, x: Floats, pressure: float) -> Settled | None:
        """The inflated balloon, for the first tick to start from; None if it is not stable."""
        state = self._state(x, self._sheet.volume_gradient(x))
        tangent = self._tangent(state, pressure)
        if tangent is None or not tangent.stable:
            return None
        return Settled(state, pressure, tangent, tangent, 0.0)

    def settle(self, start: Settled, push: Floats) -> Settled:
        """One tick's way towards equilibrium.

        Args:
            start: Where the last one came to.
            push: Loads, shape (n, 3) [N].
        """
        state, pressure, tangent = start.state, start.pressure, start.tangent
        length = 0.0
        for last in (*[False] * STEPS, True):
            unbalanced = push - state.force + pressure * state.g
            step, correction, slope = self._step(tangent, unbalanced)
            length = float(np.abs(step).max())
            if length < CHORD and tangent.stable:
                if length > SETTLED:
                    state = self._at_volume(state.x + step, state.g) or state
                    pressure += correction
                # In motion the tangent is this far behind at most, at rest it is of exactly here.
                allowed = CHORD if length > SETTLED else 0.0
                if np.abs(state.x - tangent.x).max() > allowed:
                    tangent = self._tangent(state, pressure) or tangent
                break
            if last:
                break
            moved = self._search(state, step, start.state, push, slope)
            if moved is None:
                # Too long a step, of a tangent next to singular: a stiffened one in the next tick.
                tangent = self._tangent(state, pressure, _STIFFENED[1:]) or tangent
                break
            state, pressure = moved, self._pressure(moved, push)
            tangent = self._tangent(state, pressure) or replace(tangent, stable=False)
            if not tangent.stable:
                break  # it took several factorisations
        stable = tangent if tangent.stable else start.stable
        return Settled(state, pressure, tangent, stable, length)

    def fields(self, tangent: Tangent, shares: Floats) -> Floats:
        """Displacement of every vertex per unit of each load, shapes (c, n, 3) [m/N]."""
        fields = np.zeros_like(shares)
        for field, share in zip(fields, shares, strict=True):
            columns, _ = tangent.solver.solve(share.reshape(1, -1)[:, self._dof])
            field.reshape(-1)[self._dof] = columns[0]
        return fields

    def _pressure(self, state: State, push: Floats) -> float:
        """The pressure that balances best what rubber and loads leave over [Pa].

        Unlike the sum of Newton's corrections it is not led astray by a tangent next to singular.
        """
        g = state.g.reshape(-1)[self._dof]
        over = (state.force - push).reshape(-1)[self._dof]
        return float(g @ over) / float(g @ g)

    def _step(self, tangent: Tangent, unbalanced: Floats) -> tuple[Floats, float, float]:
        """Newton's step (n, 3) [m], the change of pressure [Pa], and how steep it goes down [J]."""
        down = unbalanced.reshape(-1)[self._dof]
        u, q = tangent.solver.solve(down[None])
        step = np.zeros_like(unbalanced)
        step.reshape(-1)[self._dof] = u[0]
        return step, -float(q[0]), float(down @ u[0])

    def _search(
        self, state: State, step: Floats, start: State, push: Floats, slope: float
    ) -> State | None:
        """The longest step of some that lowers the energy; None where none does."""
        left = MAX_MOVE - float(np.abs(state.x - start.x).max())
        length = min(1.0, max(0.0, left) / float(np.abs(step).max()))
        now = state.under(push)
        for _ in range(_TRIES):
            moved = self._at_volume(state.x + length * step, state.g)
            if moved and moved.under(push) <= now - _GAIN * length * slope:
                return moved
            length *= _SHORTER
        return None

    def _at_volume(self, x: Floats, along: Floats) -> State | None:
        """`x` blown up or let down along `along` to the water's volume; None if it cannot be."""
        way = np.zeros_like(x)
        way.reshape(-1)[self._dof] = along.reshape(-1)[self._dof]
        g = self._sheet.volume_gradient(x)
        for _ in range(8):
            # The volume is a third of g . x (Euler, as it is homogeneous of degree 3).
            lost = float((g * x).sum()) / 3.0 - self._volume
            if abs(lost) < 1e-13 * self._volume:
                return self._state(x, g)
            rise = float((g * way).sum())
            if rise <= 0.0:
                return None
            x = x - (lost / rise) * way
            g = self._sheet.volume_gradient(x)
        return None

    def _state(self, x: Floats, g: Floats) -> State:
        strain = self._sheet.strained(x)
        return State(x, strain, self._sheet.energy(strain), self._sheet.force(strain), g)

    def _tangent(
        self, state: State, pressure: float, shares: tuple[float, ...] = _STIFFENED
    ) -> Tangent | None:
        """Factored, stiffened as little of `shares` as it takes; None if nothing helped."""
        entries = self._sheet.tangent(state.strain, state.x, pressure)
        scale = float(entries[self._diagonal].mean())
        g = state.g.reshape(-1)[self._dof]
        for share in shares:
            entries[self._diagonal] += share * scale
            try:
                return Tangent(state.x, HeldWater(self._band, entries, g), stable=share == 0.0)
            except Unstable:
                continue
        return None
