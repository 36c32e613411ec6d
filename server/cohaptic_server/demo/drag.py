"""A hand that drags another's material: reference forces along the surface, and their delay.

Both fingers stick. `right` touches down first, and `left` on the surface as deformed by `right`;
from then on the equilibrium is linear (`world/sticking_equilibrium.py`). The position of the
material under a hand follows from its own tip and force,

    material = tip + C f,

whatever the network does. The delay is that of this position, relative to the position that the
force of the other hand would give it at the same instant.
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
    """The reference of a drag.

    Args:
        rest: Equilibrium before the drag.
        dragged: Equilibrium after it.
        compliance: Compliance C of both contacts, shape (2, 3, 2, 3) [m/N].
    """

    rest: StickingEquilibrium
    dragged: StickingEquilibrium
    compliance: Floats

    @property
    def change(self) -> Floats:
        """Change of each tangential force by the drag, shape (2, 3) [N]."""
        return self.along(self.dragged.force - self.rest.force)

    @property
    def friction_needed(self) -> Floats:
        """Coefficient of friction below which a finger slips at either end, shape (2,)."""
        return np.maximum(self.rest.friction_needed, self.dragged.friction_needed)

    def along(self, forces: Floats) -> Floats:
        """Tangential part of each hand's force, shape (2, 3, ...) [N]."""
        n = self.rest.normal
        pressed = np.einsum("ui,ui...->u...", n, forces)
        return np.asarray(forces - np.einsum("ui,u...->ui...", n, pressed))

    def felt(self, change: Floats) -> Floats:
        """Measured change of each force along the reference change, shape (2,) [N]."""
        expected = self.change
        projected = np.einsum("ui,ui->u", change, expected)
        return np.asarray(projected / np.linalg.norm(expected, axis=1))

    def delay(self, timeline: Timeline, window: slice) -> float:
        """Delay with which `right` is dragged in a window; NaN if its force hardly changes [s]."""
        direction = self.change[RIGHT] / np.linalg.norm(self.change[RIGHT])
        forces, tips = timeline.forces[:, :, window], timeline.tips[:, :, window]
        C = self.compliance
        material = direction @ (tips[RIGHT] + C[RIGHT, :, RIGHT, :] @ forces[RIGHT])
        at_once = -direction @ C[RIGHT, :, LEFT, :] @ forces[LEFT]
        # As the force on a tip at rest: `felt_delay` has a threshold in newtons.
        stiffness = 1.0 / float(direction @ C[RIGHT, :, RIGHT, :] @ direction)
        t = timeline.t[window]
        return felt_delay(t, stiffness * material, t, stiffness * at_once)


def reference_drag(scene: Scene, body: Body) -> Drag:
    """Equilibria of a scene in which the first hand drags and the second sticks beside it.

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
