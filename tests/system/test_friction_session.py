"""Force on a sticking finger when others drag the material under it (science 3.10)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from cohaptic.simulated.hand import HandScript, Rhythm
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import (
    StickingEquilibrium,
    StickingHand,
    solve_sticking,
    touch_down,
)

MU = 1.0  # rubber on rubber; the reference shows whether it is enough
APART = math.radians(30.0)
DEPTH = 0.02  # m
ALLOWED = 0.05  # of the change of a force


@pytest.fixture(scope="module")
def balloon() -> Balloon:
    return Balloon()


@dataclass(frozen=True)
class Played:
    """Forces before a drag and after it, in a session and in equilibrium.

    Args:
        before: In the session, shape (2, 3) [N].
        after: In the session, shape (2, 3) [N].
        rest: Equilibrium before.
        dragged: Equilibrium after.
    """

    before: Floats
    after: Floats
    rest: StickingEquilibrium
    dragged: StickingEquilibrium

    @property
    def errors(self) -> Floats:
        """Of each change along the surface, over the true one, shape (2,)."""
        n = self.rest.normal
        wrong = along(self.after - self.before, n) - self.changes
        return np.asarray(np.linalg.norm(wrong, axis=1) / np.linalg.norm(self.changes, axis=1))

    @property
    def changes(self) -> Floats:
        """True change of each force along the surface, shape (2, 3) [N]."""
        return along(self.dragged.force - self.rest.force, self.rest.normal)


def along(force: Floats, normal: Floats) -> Floats:
    """The part of forces along surfaces, shape (n, 3)."""
    pressed = np.einsum("ni,ni->n", force, normal)
    return np.asarray(force - pressed[:, None] * normal)


def play(body: Balloon, delay: float, *, drags: tuple[float, float]) -> Played:
    """A touches first; B presses beside it; then one or both drag.

    Args:
        body: That is touched.
        delay: One way [s].
        drags: Of A and of B, to their own right; 0 rests [m].
    """
    engaged = 1.0 + 2.0 * delay
    later = 1.0 + 6.0 * delay  # s by which B comes after A: it finds the surface as A leaves it
    half = later + 1.5 + 18.0 * delay  # s for coupled hands to come to rest
    rhythm = Rhythm(2.0 * half)
    # Who drags presses half a period later than who rests; of two who drag A is first.
    scripts = [
        HandScript(0.0, DEPTH, rhythm if drags[0] else None, engaged, drag=drags[0]),
        HandScript(APART, DEPTH, rhythm, engaged + later, drag=drags[1]),
    ]
    session = VirtualSession(body)
    users = [
        session.join(f"user{i}", script, delay=delay, seed=i, friction=MU)
        for i, script in enumerate(scripts)
    ]

    def forces() -> Floats:
        return np.array([user.state.safety.force for user in users])

    session.run(engaged + 2.0 * half - 0.01)
    before = forces()
    session.run(half)
    info = describe(body)
    intentions = [script.intention(info.center, info.radius) for script in scripts]
    stiffness = [script.hand.stiffness for script in scripts]
    alone = solve_sticking(body, [])
    hands: list[tuple[StickingHand, StickingHand]] = []
    for script, intention, k in zip(scripts, intentions, stiffness, strict=True):
        contact = touch_down(
            body, np.array(intention.position(0.0)), np.array(intention.direction), alone
        )
        off, out = (0.0, 1.0) if script.drag else (1.0, 1.0)
        hands.append(
            (
                StickingHand(intention.tip(off), k, contact),
                StickingHand(intention.tip(out), k, contact),
            )
        )
        alone = solve_sticking(body, [rest for rest, _ in hands])
    rest, dragged = (solve_sticking(body, [pair[i] for pair in hands]) for i in (0, 1))
    return Played(before, forces(), rest, dragged)


@pytest.mark.parametrize("delay", [0.0, 0.25])
def test_a_finger_that_sticks_feels_another_drag_its_material(
    balloon: Balloon, delay: float
) -> None:
    """As much as body and hands in equilibrium say, with the 3x3 compliance, at any delay."""
    played = play(balloon, delay, drags=(0.0, -0.006))
    assert np.linalg.norm(played.changes[0]) > 0.6  # N
    assert (played.dragged.friction_needed < MU).all()
    assert (played.errors < ALLOWED).all()


@pytest.mark.parametrize("delay", [0.08])
def test_two_who_drag_against_each_other_feel_the_reference(balloon: Balloon, delay: float) -> None:
    played = play(balloon, delay, drags=(0.003, -0.004))
    assert (played.dragged.friction_needed < MU).all()
    assert (played.errors < ALLOWED).all()
    off = np.linalg.norm(played.after - played.dragged.force, axis=1)
    assert (off < ALLOWED * np.linalg.norm(played.dragged.force, axis=1)).all()
