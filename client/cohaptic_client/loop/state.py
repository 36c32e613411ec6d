"""Data of the loop: its settings, and its memory from period to period.

The module also makes the local surface of a patch, on which the loop presses.
"""

from __future__ import annotations

import math
import sys
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

from cohaptic.control.friction import NO_FRICTION, Compliance3, FrictionState
from cohaptic.control.geometry import LocalSurface, Sight
from cohaptic.control.law import Law
from cohaptic.control.laws.model import LawSettings
from cohaptic.control.mesh_fit import RestSurface, unpack
from cohaptic.control.mesh_surface import MeshSurface, Surface
from cohaptic.control.playout import NOT_PLAYED, Playout
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.status.reason import OUTSIDE
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.loop.law_fade import LawFade
from cohaptic_client.loop.passivity import NOTHING_OWED, Passivity
from cohaptic_client.loop.replica import Replica
from cohaptic_client.loop.safety import (
    NEVER_ENGAGED,
    Mode,
    SafetyLimits,
    SafetyState,
)
from cohaptic_client.loop.trust import FULL_TRUST, Trust


def flat_surface(patch: Patch) -> LocalSurface:
    """Return the plane or sphere of a patch; a mesh patch has one under its mesh, too."""
    return LocalSurface(
        patch.x_free, patch.normal, patch.curvature, patch.c_ii, patch.own_force, patch.u_others
    )


class SurfaceMaker:
    """Makes the local surface of each patch, whether plane, sphere or mesh.

    Args:
        mesh: The resting mesh; None for a client that did not request mesh patches.
    """

    def __init__(self, mesh: RestMesh | None = None) -> None:
        self._rest = None if mesh is None else RestSurface(mesh.vertices, mesh.faces)

    def __call__(self, patch: Patch) -> Surface:
        """Return the local surface of a patch."""
        near, base = patch.neighbourhood, flat_surface(patch)
        if near is None or self._rest is None:
            return base
        words = array("h", near.items)
        if sys.byteorder == "big":
            words.byteswap()
        # Rounding to units of softer vertices may leave a stiff vertex with a compliance of zero.
        facts = unpack(words, near.scale, near.c_scale, MIN_COMPLIANCE)
        # With friction the finger sticks to the material, and moves with it if other users move it.
        moved = 0.0 if patch.compliance is not None else norm(patch.u_others)
        return MeshSurface(self._rest, base, facts, moved)


@dataclass(frozen=True, slots=True)
class LoopSettings:
    """Settings of one client's loop, which stay constant while the loop runs.

    Args:
        simulation_period: Time between patches, N haptic periods [s].
        limits: Limits of the safety layer.
        law: Settings of the law's integral.
        smoothing: Fraction of the time from patch to patch over which the loop moves to a new one,
            0 to 1; at 0 the surface jumps to each new patch, as in the paper.
        max_damping: Largest damping of the passivity layer; 0 switches the layer off [N s/m].
        surface: Function that makes the local surface of a patch.
        friction: Coefficient of friction mu of the contact; 0 for none.
        follow: Whether the gains follow the compliance C_ii while the probe slides over the body;
            False for gains that the user has fixed.
        max_stiffness: Largest gain that the device renders stably [N/m].
    """

    simulation_period: float
    limits: SafetyLimits
    law: LawSettings = field(default_factory=LawSettings)
    smoothing: float = 1.0
    max_damping: float = 0.0
    surface: Callable[[Patch], Surface] = flat_surface
    friction: float = 0.0
    follow: bool = True
    max_stiffness: float = math.inf


class Coming(NamedTuple):
    """A patch whose time is still to come, and its surface."""

    patch: Patch
    surface: Surface


@dataclass(init=False)
class LoopState:
    """Memory of the loop from period to period.

    Fields:
        patch: Newest patch that is shown, or moved to; None before the first.
        arrived: Time at which the newest patch arrived [s].
        before: Surface of the patch before `patch`; None if there is none.
        offset: Shown surface less `before`, both sampled at the probe when the move to `patch`
            began; None without `before`.
        surface: Surface of `patch`; None before the first.
        k_h_before: Gain in use when the move to `patch` began [N/m].
        fade: Law in use; None before the first patch.
        normal_force: Normal force of the law in the last period [N].
        sight: Sample of the surface shown in the last period; None before the first.
        depth: Depth of the probe below that surface, slewed by `hold_back` [m]. The surface leaves
            out this client's own force: the friction's normal shift, and for the laws of the paper
            the dent of that force, are subtracted later. -inf without a surface.
        probe: Position of the tip in the last period [m].
        normal: Direction of the normal force in the last period, slewed by `turn_back`.
        passivity: Memory of the passivity layer.
        friction: State of the friction after the last period.
        compliance: Compliance matrix C that the friction uses [m/N], slewed towards that of the
            newest patch; None before the first, and without friction.
        safety: Memory of the safety layer.
        patience: Time for which the server may be silent on this link [s].
        replica: Models of the hands; None before the first patch with partners.
        trust: How far models are trusted, whichever they are.
        playout: Playing time of patches.
        coming: Patches whose time is still to come, oldest first.
        memories: Memories of rules of other packages.
        move_begins, move_ends: Playing times at which the move to `patch` begins and ends [s].
    """

    patch: Final[Patch | None]
    arrived: Final[float]
    before: Final[Surface | None]
    offset: Final[Sight | None]
    surface: Final[Surface | None]
    k_h_before: Final[float]
    fade: Final[LawFade | None]
    normal_force: Final[float]
    sight: Final[Sight | None]
    depth: Final[float]
    probe: Final[Vec3]
    normal: Final[Vec3]
    passivity: Final[Passivity]
    friction: Final[FrictionState]
    compliance: Final[Compliance3 | None]
    safety: Final[SafetyState]
    patience: Final[float]
    replica: Final[Replica | None]
    trust: Final[Trust]
    playout: Final[Playout]
    coming: Final[tuple[Coming, ...]]
    move_begins: Final[float]
    move_ends: Final[float]
    memories: Final[tuple[object, ...]]

    def __init__(
        self,
        patch: Patch | None = None,
        arrived: float = -math.inf,
        before: Surface | None = None,
        offset: Sight | None = None,
        surface: Surface | None = None,
        k_h_before: float = 0.0,
        fade: LawFade | None = None,
        normal_force: float = 0.0,
        sight: Sight | None = None,
        depth: float = -math.inf,
        probe: Vec3 = ZERO,
        normal: Vec3 = (0.0, 0.0, 1.0),
        passivity: Passivity = NOTHING_OWED,
        friction: FrictionState = NO_FRICTION,
        compliance: Compliance3 | None = None,
        safety: SafetyState = NEVER_ENGAGED,
        patience: float = 0.0,
        replica: Replica | None = None,
        trust: Trust = FULL_TRUST,
        playout: Playout = NOT_PLAYED,
        coming: tuple[Coming, ...] = (),
        move_begins: float = 0.0,
        move_ends: float = 0.0,
        memories: tuple[object, ...] = (),
    ) -> None:
        self.patch = patch
        self.arrived = arrived
        self.before = before
        self.offset = offset
        self.surface = surface
        self.k_h_before = k_h_before
        self.fade = fade
        self.normal_force = normal_force
        self.sight = sight
        self.depth = depth
        self.probe = probe
        self.normal = normal
        self.passivity = passivity
        self.friction = friction
        self.compliance = compliance
        self.safety = safety
        self.patience = patience
        self.replica = replica
        self.trust = trust
        self.playout = playout
        self.coming = coming
        self.move_begins = move_begins
        self.move_ends = move_ends
        self.memories = memories

    def silenced(self) -> LoopState:
        """Return this state with an infinitely old newest patch, so that the force fades."""
        return replace(self, arrived=-math.inf)

    def acknowledged(self) -> LoopState:
        """Return the state after the user has acknowledged a fault: the hand may be engaged again.

        The state stays unchanged until the force is zero: a fault cannot be acknowledged before the
        force has been released. Zero force is enough, even if a release is under way, because a new
        release begins in every period in which the user does not hold the switch.
        """
        safety = self.safety
        if safety.mode is not Mode.FAULT or safety.force != ZERO:
            return self
        return replace(
            self, safety=SafetyState(now=safety.now, fault=safety.fault, cause=safety.cause)
        )

    def taken_away(self, fault: str, limits: SafetyLimits) -> LoopState:
        """Return this state with zero force, after a fault outside the loop took the force away.

        Args:
            fault: Reason why the force was taken away.
        """
        latched = limits.latch or self.safety.mode is Mode.FAULT
        mode = Mode.FAULT if latched else Mode.WAITING
        safety = SafetyState(mode, now=self.safety.now, fault=fault, cause=OUTSIDE)
        return replace(self, safety=safety)

    @property
    def k_h(self) -> float:
        """Gain in use [N/m]; 0 before the first patch."""
        return self.fade.now.gains.k_h if self.fade is not None else 0.0

    @property
    def law(self) -> Law | None:
        """Law in use; None before the first patch."""
        return self.fade.now.law if self.fade is not None else None
