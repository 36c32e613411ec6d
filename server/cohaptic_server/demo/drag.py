"""A hand that drags another's material: the truth of it, and what was felt along the surface.

Both fingers stick. `right` comes first and `left` finds the surface as that has left it; then the
truth is linear (`sticking.py`). Each hand's own tip and force say where its material is,

    material = tip + C f,

whatever the network does, and so how late it was carried along: beside where the force of the other
would have it at that instant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.body import Body
from cohaptic_server.demo.analysis import Timeline
from cohaptic_server.demo.lateness import felt_delay
from cohaptic_server.demo.scene import Scene
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.sticking_equilibrium import (
    StickingEquilibrium,
    StickingHand,
    compliance_of,
    solve_sticking,
    touch_down,
)

LEFT, RIGHT = 0, 1


@dataclass(frozen=True, eq=False)
class Drag:
    """What a drag does in truth.

    Args:
        rest: Body and hands before it.
        dragged: The same, once the first hand has dragged.
        compliance: C of both contacts, shape (2, 3, 2, 3) [m/N].
    """

    rest: StickingEquilibrium
    dragged: StickingEquilibrium
    compliance: Floats

    @property
    def change(self) -> Floats:
        """Of each force along the surface, by the drag, shape (2, 3) [N]."""
        return self.along(self.dragged.force - self.rest.force)

    @property
    def friction_needed(self) -> Floats:
        """Coefficient below which a finger slips, before the drag or after it, shape (2,)."""
        return np.maximum(self.rest.friction_needed, self.dragged.friction_needed)

    def along(self, forces: Floats) -> Floats:
        """The part of each hand's force along the surface, shape (2, 3, ...)."""
        n = self.rest.normal
        pressed = np.einsum("ui,ui...->u...", n, forces)
        return np.asarray(forces - np.einsum("ui,u...->ui...", n, pressed))

    def felt(self, change: Floats) -> Floats:
        """Size of a measured change, in the direction of the true one, shape (2,) [N]."""
        true = self.change
        return np.asarray(np.einsum("ui,ui->u", change, true) / np.linalg.norm(true, axis=1))

    def delay(self, timeline: Timeline, window: slice) -> float:
        """How late `right` was dragged in a window round a drag; NaN where it was not felt [s]."""
        way = self.change[RIGHT] / np.linalg.norm(self.change[RIGHT])
        forces, tips = timeline.forces[:, :, window], timeline.tips[:, :, window]
        C = self.compliance
        material = way @ (tips[RIGHT] + C[RIGHT, :, RIGHT, :] @ forces[RIGHT])
        at_once = -way @ C[RIGHT, :, LEFT, :] @ forces[LEFT]
        # As a force on a tip that holds still, so that a change is felt or not in newtons.
        stiffness = 1.0 / float(way @ C[RIGHT, :, RIGHT, :] @ way)
        t = timeline.t[window]
        return felt_delay(t, stiffness * material, t, stiffness * at_once)


def true_drag(scene: Scene, body: Body) -> Drag:
    """The truth of a scene in which the first hand drags and the second sticks beside it.

    Raises:
        BodyError: A hand finds no surface on its way, or there is no equilibrium.
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
