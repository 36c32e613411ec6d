"""Compares the measured force on each hand with the reference, for a press or a drag.

In a drag both fingers stick, and the reference consists of the tangential forces in equilibrium.
`right` touches down first, and then `left`, on the surface that `right` has deformed; from then on
the equilibrium is linear (`world/equilibrium.py`). The position of the material under a hand
follows from the hand's own tip, its force f and the compliance C of its contact,

    material = tip + C f,

whatever the network does. The measured delay is the delay of this position, relative to the
position that the force of the other hand would cause at the same instant.

In a press, the measured delay of a force is relative to the same hands, with the same intentions,
simulated without a network (`world/at_once.py`). No recorded tip or force takes part in that
simulation: they are late themselves, and a reference that contains them hides a part of the delay.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import CohapticError
from cohaptic.simulated.hand import Hand, HandState, Intention, ease, move
from cohaptic.vec import ZERO, Vec3
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.at_once import PERIOD, Mover, play_at_once
from cohaptic_server.world.equilibrium import (
    StickingEquilibrium,
    StickingHand,
    compliance_of,
    solve_sticking,
    touch_down,
)
from cohaptic_tools.demo.analysis import AROUND, STEP, Timeline, mean_over, measured
from cohaptic_tools.demo.lateness import LEAST, UNKNOWN, Late, late, passed
from cohaptic_tools.demo.scene import Scene, reference

_APPROACH = 0.3  # s in which the simulated hands come to where they rest before the press
_RESTS = 0.7  # s from the start of the approach to the press; hands and body have come to rest
_BEFORE = 0.25  # s before the press, at rest
_PRESSED = 0.8  # s for which the press is simulated; without a network it is over before
# Instants of 1 ms for which a response of the body is used. A rubber balloon takes 30 ms for one,
# and with 10 instants each share comes within 2 ms of where it comes with 1.
_EVERY = 10


def without_network(scene: Scene, body: Body) -> list[Floats]:
    """Return when each hand feels levels of the first hand's press without a network (`passed`).

    Args:
        scene: Scene with the places, depths and mechanics of the hands.
        body: Touched body, at rest.
    """
    info = describe(body)
    hands: list[Mover] = []
    for user in range(scene.users):
        script = scene.script(user)
        plan = script.intention(info.center, info.radius)
        rests = 0.0 if plan.rhythm else 1.0  # level before the press
        hands.append(_Scripted(script.hand, plan, rests))
    motion = play_at_once(body, hands, _RESTS + _PRESSED, every=_EVERY)
    instants = np.arange(1, motion.from_others.shape[1] + 1, dtype=np.float64)
    t = np.asarray(PERIOD * instants - _RESTS, dtype=np.float64)
    seen = t >= -_BEFORE
    return [passed(t[seen], felt[seen]) for felt in motion.from_others]


class _Scripted:
    """A hand that approaches, rests, and presses at `_RESTS` if its intention has a rhythm."""

    def __init__(self, hand: Hand, plan: Intention, rests: float) -> None:
        self._hand, self._plan, self._rests = hand, plan, rests
        self._state = HandState(plan.tip(0.0), ZERO)

    def __call__(self, now: float, force: Vec3) -> Vec3:
        level = self._rests * ease(now / _APPROACH)
        if self._plan.rhythm is not None and now > _RESTS:
            level = ease((now - _RESTS) / self._plan.rhythm.ramp)
        self._state = move(self._state, self._hand, self._plan.tip(level), force, PERIOD)
        return self._state.position


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

    def delay(self, timeline: Timeline, window: slice) -> Late:
        """Return the delays with which `right` is dragged [s]; NaN if it hardly moves.

        Args:
            timeline: Recordings of all users.
            window: Grid indices around the drag.
        """
        direction = self.change[RIGHT] / np.linalg.norm(self.change[RIGHT])
        forces, tips = timeline.forces[:, :, window], timeline.tips[:, :, window]
        C = self.compliance
        material = direction @ (tips[RIGHT] + C[RIGHT, :, RIGHT, :] @ forces[RIGHT])
        at_once = -direction @ C[RIGHT, :, LEFT, :] @ forces[LEFT]
        # Positions are scaled to forces on a tip at rest, since `passed` has a threshold [N].
        stiffness = 1.0 / float(direction @ C[RIGHT, :, RIGHT, :] @ direction)
        t = timeline.t[window]
        return late(passed(t, stiffness * material), passed(t, stiffness * at_once))


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
        start, inward = np.array(intention.position(0.0)), np.array(intention.direction)
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


@dataclass(frozen=True, slots=True)
class Compared:
    """Measured and reference forces of one user; unknown values are NaN.

    Args:
        felt: Measured force that the other users cause [N].
        reference: Force that the other users cause in the equilibrium of body and hands [N].
        error: Difference of the two divided by the reference, or by `LEAST` if that is larger.
        force: Measured force on the hand [N].
        reference_force: Force on the hand in equilibrium [N].
        late: Delays of the measured force, relative to the force without a network [s].
        friction_needed: Coefficient of friction below which the finger slips.
    """

    felt: float
    reference: float
    error: float
    force: float
    reference_force: float
    late: Late
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
    fraction = np.abs(felt - expected.felt_from_others)
    fraction /= np.maximum(np.abs(expected.felt_from_others), LEAST)

    try:
        true = without_network(scene, body) if windows else []
    except (CohapticError, np.linalg.LinAlgError):  # the forces at rest are known without it
        true = []

    def delays(window: slice) -> list[Late]:
        since = timeline.t[window] - timeline.t[window.start + round(AROUND / STEP)]
        felt = timeline.felt[:, window]
        if not true:
            return [UNKNOWN] * scene.users
        return [late(passed(since, felt[i]), true[i]) for i in range(scene.users)]

    found_late = _median(delays, windows, scene.users)
    found_late[0] = UNKNOWN  # the first hand makes the change and has no delay
    found = (felt, expected.felt_from_others, fraction, force, expected.force)
    return _rows(found, found_late, np.full(scene.users, math.nan))


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

    def delays(window: slice) -> list[Late]:
        of_all = [UNKNOWN] * scene.users
        of_all[RIGHT] = expected.delay(timeline, window)
        return of_all

    needed = expected.friction_needed
    # If one finger slips, the other is dragged less, and the reference holds for neither.
    whole = np.where((needed <= scene.friction).all(), 1.0, math.nan)
    found = (
        expected.felt(change),
        whole * sizes,
        whole * error,
        np.linalg.norm(after, axis=1),
        whole * np.linalg.norm(expected.dragged.force, axis=1),
    )
    return _rows(found, _median(delays, windows, scene.users), needed)


def _rows(found: Sequence[Floats], late: Sequence[Late], needed: Floats) -> list[Compared]:
    felt, reference, error, force, reference_force = (values.tolist() for values in found)
    return [
        Compared(*row)
        for row in zip(
            felt, reference, error, force, reference_force, late, needed.tolist(), strict=True
        )
    ]


def _median(
    delays: Callable[[slice], list[Late]], windows: Sequence[slice], users: int
) -> list[Late]:
    """Return the median of each user's delays over the windows; NaN without a value."""
    if not windows:
        return [UNKNOWN] * users
    found = np.array([delays(window) for window in windows])
    with warnings.catch_warnings():
        # A user without any value has a median of NaN, which numpy warns of.
        warnings.simplefilter("ignore", RuntimeWarning)
        return [Late(*map(float, row)) for row in np.nanmedian(found, axis=0)]
