"""Compares the measured force on each hand with the reference, for a press or a drag.

In a drag both fingers stick, and the reference consists of the tangential forces in equilibrium.
`right` touches down first, and then `left`, on the surface that `right` has deformed; from then on
the equilibrium is linear (`world/equilibrium.py`). The position of the material under a hand
follows from the hand's own tip, its force f and the compliance C of its contact,

    material = tip + C f,

whatever the network does. The measured delay is the delay of this position, relative to the
position that the force of the other hand would cause at the same instant.

In a press, the reference is the force on each hand that the other hands cause without a network. It
is computed from the recorded tips and forces: at each instant the forces that all users have at
that instant act on the body, and each contact is located on the surface displaced by all forces but
its own. There is no delay, no lag of the room and no rate limit. The force that the others cause is
the difference between the body with and without the other users. The delay of the recorded force is
measured against this force (`lateness.py`); both contain the same motion of the hands.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.body import Body, Response
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.contact import Contact, locate
from cohaptic_server.world.contact_tracking import RELAXATION
from cohaptic_server.world.displacement_field import CachedField, Field, FreeField, ZeroField
from cohaptic_server.world.equilibrium import (
    StickingEquilibrium,
    StickingHand,
    compliance_of,
    solve_sticking,
    touch_down,
)
from cohaptic_tools.demo.analysis import AROUND, STEP, Timeline, mean_over, measured
from cohaptic_tools.demo.lateness import LEAST, felt_delay
from cohaptic_tools.demo.scene import Scene, reference

_FINE, _COARSE = 0.01, 0.05  # s between instants while forces change, and while they rest
_CHANGE = 1.0  # s from the start of a press during which forces change without a network
_SETTLE = 30  # iterations of the contacts at the first instant
_AROUND = 0.02  # m around a contact; radius of the window of displacements


def instants(window: slice) -> Ints:
    """Return the n grid indices within a window at which forces are computed, shape (n,)."""
    fine, coarse = round(_FINE / STEP), round(_COARSE / STEP)
    start = window.start + round(AROUND / STEP)
    end = min(window.stop, start + round(_CHANGE / STEP))
    return np.array(
        [
            *range(window.start, start, coarse),
            *range(start, end, fine),
            *range(end, window.stop, coarse),
        ]
    )


@dataclass(frozen=True, eq=False)
class _Hand:
    """One hand at an instant: its contact, and the displacement field in which it was located."""

    contact: Contact
    surface: Field


def felt_at_once(timeline: Timeline, body: Body, window: slice) -> tuple[Floats, Floats]:
    """Return the force that the other hands cause on each hand without a network.

    Args:
        timeline: Recordings of all users.
        body: Touched body, at rest.
        window: Grid indices around a press.

    Returns:
        Times of the n instants, shape (n,) [s], and forces, shape (users, n) [N].
    """
    tips, forces = timeline.tips, timeline.forces
    damping = timeline.columns["scale"] * timeline.columns["damping"]
    hands: list[_Hand | None] = [None] * len(tips)
    response: Response | None = None
    at = instants(window)
    felt: list[list[float]] = []
    for k in [*[int(at[0])] * _SETTLE, *at.tolist()]:
        located = [_locate(body, tip, hand) for tip, hand in zip(tips[:, :, k], hands, strict=True)]
        # The damping of the passivity layer acts only on the hand, not on the body.
        pressed = [
            max(0.0, float(hand.contact.normal @ force - damped))
            for hand, force, damped in zip(located, forces[:, :, k], damping[:, k], strict=True)
        ]
        loads = [hand.contact.load(f) for hand, f in zip(located, pressed, strict=True)]
        response = body.respond(loads, response)
        free = [FreeField(response, np.array([f]), slice(i, i + 1)) for i, f in enumerate(pressed)]
        own = np.diag(response.compliance)
        felt.append(
            [
                _felt(hand.contact, tip, field, float(c))
                for hand, tip, field, c in zip(located, tips[:, :, k], free, own, strict=True)
            ]
        )
        hands = [_follow(body, hand, field) for hand, field in zip(located, free, strict=True)]
    return timeline.t[at], np.array(felt[_SETTLE:]).T


def _locate(body: Body, tip: Floats, before: _Hand | None) -> _Hand:
    surface = ZeroField() if before is None else before.surface
    hint = None if before is None else before.contact
    return _Hand(locate(body.mesh, tip, surface, radius=body.contact_radius, hint=hint), surface)


def _follow(body: Body, hand: _Hand, free: FreeField) -> _Hand:
    """Return a hand whose displacement field is moved by `RELAXATION` towards the free field.

    The free field is the displacement of the body without the force of this hand [m].
    """
    near = body.mesh.near(hand.contact.foot, body.contact_radius + _AROUND)
    previous = hand.surface[near]
    return _Hand(
        hand.contact, CachedField(near, previous + RELAXATION * (free.on(near) - previous), free)
    )


def _felt(contact: Contact, tip: Floats, free: Field, compliance: float) -> float:
    """Return the body's normal force on a tip minus its force without the other users [N]."""
    depth = float(contact.normal @ (contact.moved(free) - tip))
    alone = float(contact.normal @ (contact.point - tip))
    return (max(0.0, depth) - max(0.0, alone)) / compliance


LEFT, RIGHT = 0, 1


@dataclass(frozen=True, eq=False)
class Drag:
    """Equilibria of a drag, to which the measured forces are compared.

    Args:
        rest: Equilibrium before the drag.
        dragged: Equilibrium after the drag.
        compliance: Compliance matrix C of both contacts, shape (2, 3, 2, 3) [m/N].
    """

    rest: StickingEquilibrium
    dragged: StickingEquilibrium
    compliance: Floats

    @property
    def change(self) -> Floats:
        """Change of each hand's tangential force by the drag, shape (2, 3) [N]."""
        return self.along(self.dragged.force - self.rest.force)

    @property
    def friction_needed(self) -> Floats:
        """Coefficient of friction below which each finger slips before or after the drag, (2,)."""
        return np.maximum(self.rest.friction_needed, self.dragged.friction_needed)

    def along(self, forces: Floats) -> Floats:
        """Return the tangential part of each hand's force, shape (2, 3, ...) [N]."""
        n = self.rest.normal
        pressed = np.einsum("ui,ui...->u...", n, forces)
        return np.asarray(forces - np.einsum("ui,u...->ui...", n, pressed))

    def felt(self, change: Floats) -> Floats:
        """Return each measured change of force, projected on the reference change, shape (2,) [N].

        Args:
            change: Measured change of each hand's tangential force, shape (2, 3) [N].
        """
        expected = self.change
        projected = np.einsum("ui,ui->u", change, expected)
        return np.asarray(projected / np.linalg.norm(expected, axis=1))

    def delay(self, timeline: Timeline, window: slice) -> float:
        """Return the delay with which `right` is dragged [s]; NaN if it hardly moves.

        Args:
            timeline: Recordings of all users.
            window: Grid indices around the drag.
        """
        direction = self.change[RIGHT] / np.linalg.norm(self.change[RIGHT])
        forces, tips = timeline.forces[:, :, window], timeline.tips[:, :, window]
        C = self.compliance
        material = direction @ (tips[RIGHT] + C[RIGHT, :, RIGHT, :] @ forces[RIGHT])
        at_once = -direction @ C[RIGHT, :, LEFT, :] @ forces[LEFT]
        # Positions are scaled to forces on a tip at rest, since `felt_delay` has a threshold [N].
        stiffness = 1.0 / float(direction @ C[RIGHT, :, RIGHT, :] @ direction)
        t = timeline.t[window]
        return felt_delay(t, stiffness * material, t, stiffness * at_once)


def reference_drag(scene: Scene, body: Body) -> Drag:
    """Return the equilibria of a scene in which `left` drags and `right` sticks beside it.

    Raises:
        BodyError: A hand meets no surface on its way, or there is no equilibrium.
    """
    info = describe(body)
    hands: dict[int, tuple[StickingHand, StickingHand]] = {}
    held = solve_sticking(body, [])
    for user in (RIGHT, LEFT):
        script = scene.script(user)
        intention = script.intention(info.center, info.radius)
        start, inward = np.array(intention.at(0.0)), np.array(intention.direction)
        contact = touch_down(body, start, inward, held)
        levels = (0.0, 1.0) if intention.drags else (1.0, 1.0)
        before, after = (
            StickingHand(intention.tip(level), script.hand.stiffness, contact) for level in levels
        )
        hands[user] = (before, after)
        held = solve_sticking(body, [before for before, _ in hands.values()])
    pairs = [hands[LEFT], hands[RIGHT]]
    rest, dragged = (solve_sticking(body, [pair[i] for pair in pairs]) for i in (0, 1))
    return Drag(rest, dragged, compliance_of(body, [before for before, _ in pairs]))


_REPLAYED = 4  # windows from which delays are measured; each takes seconds of computation


@dataclass(frozen=True, slots=True)
class Compared:
    """Measured and reference forces of one user; unknown values are NaN.

    Args:
        felt: Measured force that the other users cause [N].
        reference: Force that the other users cause in the equilibrium of body and hands [N].
        error: Difference of the two divided by the reference, or by `LEAST` if that is larger.
        force: Measured force on the hand [N].
        reference_force: Force on the hand in equilibrium [N].
        delay: Delay of the measured force, relative to the force without a network [s].
        friction_needed: Coefficient of friction below which the finger slips.
    """

    felt: float
    reference: float
    error: float
    force: float
    reference_force: float
    delay: float
    friction_needed: float = math.nan


def compare(
    scene: Scene,
    body: Body,
    timeline: Timeline,
    pressed: Sequence[slice],
    off: Sequence[slice],
    windows: Sequence[slice],
) -> list[Compared]:
    """Return for every user the measured forces, the reference forces and the delay.

    Args:
        scene: Scene that the users performed.
        body: Touched body, at rest.
        timeline: Recordings of all users.
        pressed: Stretches in which the first hand stays pressed, or stays dragged.
        off: Stretches in which the first hand stays off, or has not dragged yet.
        windows: Windows around the presses or drags.
    """
    windows = windows[-_REPLAYED:]
    if scene.drags:
        return _drags(scene, body, timeline, pressed, off, windows)
    return _presses(scene, body, timeline, pressed, windows)


def _presses(
    scene: Scene,
    body: Body,
    timeline: Timeline,
    pressed: Sequence[slice],
    windows: Sequence[slice],
) -> list[Compared]:
    expected = reference(scene, body, pressed=True)
    ends = [measured(stretch) for stretch in pressed]
    felt, force = mean_over(timeline.felt, ends), mean_over(timeline.force, ends)
    share = np.abs(felt - expected.felt_from_others)
    share /= np.maximum(np.abs(expected.felt_from_others), LEAST)

    def delays(window: slice) -> list[float]:
        t, at_once = felt_at_once(timeline, body, window)
        times = timeline.t[window]
        # The first hand makes the change and has no delay.
        return [math.nan] + [
            felt_delay(times, timeline.felt[i, window], t, at_once[i])
            for i in range(1, scene.users)
        ]

    late = _median(delays, windows, scene.users)
    return [
        Compared(*map(float, row))
        for row in zip(
            felt, expected.felt_from_others, share, force, expected.force, late, strict=True
        )
    ]


def _drags(
    scene: Scene,
    body: Body,
    timeline: Timeline,
    dragged: Sequence[slice],
    rest: Sequence[slice],
    windows: Sequence[slice],
) -> list[Compared]:
    expected = reference_drag(scene, body)
    after = mean_over(timeline.forces, [measured(stretch) for stretch in dragged])
    before = mean_over(timeline.forces, [measured(stretch) for stretch in rest])
    change = expected.along(after - before)
    sizes = np.linalg.norm(expected.change, axis=1)
    error = np.linalg.norm(change - expected.change, axis=1) / np.maximum(sizes, LEAST)

    def delays(window: slice) -> list[float]:
        late = [math.nan] * scene.users
        late[RIGHT] = expected.delay(timeline, window)
        return late

    late = _median(delays, windows, scene.users)
    needed = expected.friction_needed
    # If one finger slips, the other is dragged less, and the reference holds for neither.
    whole = np.where((needed <= scene.friction).all(), 1.0, math.nan)
    return [
        Compared(*map(float, row))
        for row in zip(
            expected.felt(change),
            whole * sizes,
            whole * error,
            np.linalg.norm(after, axis=1),
            whole * np.linalg.norm(expected.dragged.force, axis=1),
            late,
            needed,
            strict=True,
        )
    ]


def _median(delays: Callable[[slice], list[float]], windows: Sequence[slice], users: int) -> Floats:
    """Return each user's median delay over the windows, shape (users,) [s]; NaN without a value."""
    values = np.array([delays(window) for window in windows]).reshape(-1, users)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # no force changed in any window
        return np.asarray(np.nanmedian(values, axis=0)) if len(values) else np.full(users, math.nan)
