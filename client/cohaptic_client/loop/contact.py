"""The contact in one period: gain, direction, depth, law, damping and friction, in that order.

Over one simulation period the gain K_h moves from its value at the arrival of a patch to the value
for that patch at the probe. Each step changes the force no faster than its part of `EXTERNAL_RATE`
allows, except for changes that the hand's own motion causes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from cohaptic.control.friction import (
    NO_FRICTION,
    Compliance3,
    FrictionState,
    believed_shift,
    friction_step,
    normal_shift,
    wedging,
)
from cohaptic.control.geometry import Sight
from cohaptic.control.law import NO_FORCE, Gains, LocalForce
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic.vec import ZERO, Vec3, add, dot, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.law_fade import LAW_FADE_RATE, LawFade, run, stiffest, with_gains
from cohaptic_client.loop.passivity import dissipate
from cohaptic_client.loop.replica import share_answered
from cohaptic_client.loop.safety import EXTERNAL_RATE, SAFETY_FADE_RATE
from cohaptic_client.loop.slew import SOFT, hold_back, slew_compliance, slew_gain, slew_normal
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.trust import beyond

# Largest factor by which C_ii differs within one patch; a larger one is an error of the patch.
MOST_CHANGE: Final = 2.0
# Least K_h C_ii for which K_h counts as the object's stiffness 1 / C_ii, in 32 bits.
_AS_STIFF: Final = 1.0 - 1e-5


def gains_as_sent(patch: Patch, settings: LoopSettings) -> Gains:
    """Return the gains in a patch, with K_h no larger than the device renders stably."""
    return Gains(min(patch.k_h, settings.max_stiffness), patch.integral_gain)


def gains_under(patch: Patch, sight: Sight, settings: LoopSettings) -> Gains:
    """Return the gains of a patch at the present position of the probe.

    The server chooses gains in proportion to 1 / C_ii, the object's stiffness at the contact. The
    compliance C_ii varies over a body: on the balloon by half from the equator to the pole. A mesh
    patch has C_ii under the probe; other patches have C_ii at their own contact only.

    Args:
        sight: Surface sample at the probe.
    """
    if not settings.follow:
        return gains_as_sent(patch, settings)
    least, most = patch.c_ii / MOST_CHANGE, patch.c_ii * MOST_CHANGE
    c_ii = max(MIN_COMPLIANCE, least, min(most, sight.c_ii))
    if not patch.law.answers_own_dent:
        # The object's stiffness here, limited to the device's. A K_h that the server has made lower
        # than 1 / C_ii is a limit, too.
        limit = settings.max_stiffness
        if patch.k_h * patch.c_ii < _AS_STIFF:
            limit = min(limit, patch.k_h)
        return Gains(min(1.0 / c_ii, limit), patch.integral_gain)
    ratio = patch.c_ii / c_ii
    k_h = min(patch.k_h * ratio, settings.max_stiffness)
    return Gains(k_h, patch.integral_gain * ratio)


def follow_gains(
    state: LoopState,
    patch: Patch,
    fade: LawFade,
    sight: Sight,
    share: float,
    counted: float,
    settings: LoopSettings,
) -> LawFade:
    """Move the gains of the law in use one period towards those of the newest patch.

    Args:
        state: State after the last period.
        patch: Newest patch; it is for the law in use.
        fade: Law in use.
        sight: Sample of the shown surface at the probe.
        share: Completed fraction of the move to the newest patch, 0 to 1.
        counted: Time since the last period, capped at two periods [s].
    """
    newest = gains_under(patch, sight, settings)
    target = state.k_h_before + share * (newest.k_h - state.k_h_before)
    k_h = slew_gain(fade.now.gains.k_h, target, counted, state.normal_force)
    gains = newest if k_h == newest.k_h else Gains(k_h, newest.integral_gain)
    return with_gains(fade, gains)


@dataclass(init=False)
class Contact:
    """The contact in one period, before the safety layer limits the force.

    Fields:
        fade: Law in use; None before the first patch.
        normal: Direction of the normal force; a unit vector.
        depth: Depth of the probe below the surface, slewed as `LoopState.depth` is [m].
        moved: Displacement of the hand in this period [m].
        moved_in: Component of that displacement into the surface [m].
        local: Force of the law, with its parts.
        damping: Damping of the passivity layer [N s/m].
        damped_force: Normal force with that damping [N].
        friction: State of the friction after this period.
        compliance: Compliance matrix C that the friction uses [m/N]; None without friction.
        law_force: Force of law and friction, whose opposite the body gets [N].
        requested_force: Force of law, friction and damping, for the safety layer [N].
    """

    fade: Final[LawFade | None]
    normal: Final[Vec3]
    depth: Final[float]
    moved: Final[Vec3]
    moved_in: Final[float]
    local: Final[LocalForce]
    damping: Final[float]
    damped_force: Final[float]
    friction: Final[FrictionState]
    compliance: Final[Compliance3 | None]
    law_force: Final[Vec3]
    requested_force: Final[Vec3]

    def __init__(
        self,
        fade: LawFade | None,
        normal: Vec3,
        depth: float,
        moved: Vec3,
        moved_in: float,
        local: LocalForce,
        damping: float,
        damped_force: float,
        friction: FrictionState,
        compliance: Compliance3 | None,
        law_force: Vec3,
        requested_force: Vec3,
    ) -> None:
        self.fade = fade
        self.normal = normal
        self.depth = depth
        self.moved = moved
        self.moved_in = moved_in
        self.local = local
        self.damping = damping
        self.damped_force = damped_force
        self.friction = friction
        self.compliance = compliance
        self.law_force = law_force
        self.requested_force = requested_force


_START: Final = LoopState()
NO_SURFACE: Final = Contact(
    fade=None,
    normal=_START.normal,
    depth=_START.depth,
    moved=ZERO,
    moved_in=0.0,
    local=NO_FORCE,
    damping=0.0,
    damped_force=0.0,
    friction=NO_FRICTION,
    compliance=None,
    law_force=ZERO,
    requested_force=ZERO,
)


# Above 60 lines: the steps share a dozen values, and their order matters.
def press(
    state: LoopState,
    sample: DeviceSample,
    sight: Sight,
    share: float,
    dt: float,
    silent: bool,
    settings: LoopSettings,
    explained: float = 0.0,
    wished: float = 0.0,
) -> Contact:
    """Compute the contact of the probe with the shown surface: law, damping and friction.

    Args:
        state: State after the last period, with a patch.
        sight: Sample of the shown surface at the probe.
        share: Completed fraction of the move to the newest patch, 0 to 1.
        dt: Time since the last period [s].
        silent: Whether the server counts as silent.
        explained: Change of the depth by models of others, which no limit may hold back [m].
        wished: Change of the depth by what others want, within its limit [m].
    """
    patch, fade = state.patch, state.fade
    assert patch is not None
    assert fade is not None
    # A late period moves the force by no more than two punctual ones would.
    counted = min(dt, 2.0 * settings.limits.period)
    moved = sub(sample.position, state.probe)

    k_h_before = fade.now.gains.k_h
    if patch.law is fade.now.law:
        fade = follow_gains(state, patch, fade, sight, share, counted, settings)
    pace = _pace_of_surface(state, fade, abs(fade.now.gains.k_h - k_h_before), silent, counted)
    k_h = stiffest(fade)
    C: Compliance3 | None = None
    if settings.friction > 0.0:
        pace *= 0.5  # the other half is for the friction and its compliance
        C = _compliance(state, patch.compliance, pace, counted / settings.simulation_period)
        if C is not None:
            # Friction amplifies a change of the normal force: leave a part of the pace for that.
            pace *= 1.0 - wedging(settings.friction, state.normal, C, k_h)

    normal = sight.normal
    if state.normal_force > 0.0 and normal != state.normal:
        normal, pace = _direction(state, sight, moved, k_h, pace, settings)
    moved_in = -dot(normal, moved)
    # A force that the hand does not get may change at once.
    most = pace if state.sight is not None and state.safety.scale > 0.0 else math.inf
    by_models = 0.0
    if explained != 0.0 or wished != 0.0:
        by_models, beyond = _by_models(sight.depth - state.depth, moved_in, explained, wished)
        most = max(0.0, most - beyond * k_h)
    depth = hold_back(state.depth + moved_in + by_models, sight.depth, most / max(k_h, SOFT))

    held = _held(state, fade, sight, depth, normal, C)
    # An experiment that has no such limit behind the law has none for its integral, either.
    most += max(0.0, settings.limits.external_rate - EXTERNAL_RATE) * counted
    fade, local = run(fade, held, counted, settings.law, moved_in, most)
    force = law_force = scale(normal, local.normal_force)
    damping, damped_force = 0.0, local.normal_force
    if settings.max_damping > 0.0 and state.sight is not None:
        damping, damped_force = _damped(state, sample, normal, damped_force, counted, settings)
        if damped_force != local.normal_force:
            force = scale(normal, damped_force)
    friction = NO_FRICTION
    if C is not None:
        k_h = fade.now.gains.k_h
        friction = _friction_force(state, sight, moved, normal, local, k_h, C, pace, settings)
        force, law_force = add(force, friction.force), add(law_force, friction.force)
    return Contact(
        fade=fade,
        normal=normal,
        depth=depth,
        moved=moved,
        moved_in=moved_in,
        local=local,
        damping=damping,
        damped_force=damped_force,
        friction=friction,
        compliance=C,
        law_force=law_force,
        requested_force=force,
    )


def _by_models(
    change: float, moved_in: float, explained: float, wished: float
) -> tuple[float, float]:
    """Return the change of the depth by models, and the part of it that uses the pace [m].

    Models may bring the depth to that below the shown surface, and not beyond it.

    Args:
        change: Depth below the shown surface, less the depth in the last period [m].
        moved_in: Displacement of the hand into the surface [m].
        explained: Change by the models' answer [m].
        wished: Change by what others want [m].
    """
    own, gap = moved_in + explained, change - moved_in
    whole = own + wished
    beyond = max(0.0, whole - max(0.0, own), min(0.0, own) - whole)
    return max(min(0.0, gap), min(max(0.0, gap), explained + wished)), beyond


def _pace_of_surface(
    state: LoopState, fade: LawFade, gain_change: float, silent: bool, counted: float
) -> float:
    """Return the largest change of the force that the surface may cause in this period [N].

    `EXTERNAL_RATE` limits all changes that the hand's own motion does not cause. A change of the
    gain, a fade of the safety layer and a change of the law take their parts of that rate first.
    """
    pace = EXTERNAL_RATE * counted
    pace -= gain_change * max(0.0, state.depth)
    if silent or state.safety.scale < 1.0:
        pace -= SAFETY_FADE_RATE * counted
    if fade.before is not None:
        pace -= LAW_FADE_RATE * counted
    return max(0.0, pace)


def _compliance(
    state: LoopState, newest: Compliance3 | None, pace: float, share: float
) -> Compliance3 | None:
    """Return the compliance matrix C for the friction [m/N], moved towards the newest one.

    Its change may use half of `pace`, the change of the force that is left in this period [N].
    """
    return slew_compliance(
        state.compliance, newest, state.friction, state.normal_force, share, 0.5 * pace
    )


def _direction(
    state: LoopState, sight: Sight, moved: Vec3, k_h: float, pace: float, settings: LoopSettings
) -> tuple[Vec3, float]:
    """Return the force direction at a surface that has turned, and the change of force left [N]."""
    if sight.depth <= 0.0:
        return state.normal, pace  # the contact ends: a vanishing force need not turn any more
    force = min(state.normal_force, settings.limits.max_force)
    return slew_normal(state.normal, sight.normal, moved, k_h, force, pace)


def _held(
    state: LoopState, fade: LawFade, sight: Sight, depth: float, normal: Vec3, C: Compliance3 | None
) -> Sight:
    """Return the surface for the law: at `depth`, less the friction's shift of the contact."""
    if C is not None:
        depth -= believed_shift(normal, C, stiffest(fade)) * normal_shift(state.friction, normal, C)
    if depth == sight.depth:
        return sight
    return Sight(depth, sight.normal, sight.c_ii, sight.own_force, sight.u_others)


def _damped(
    state: LoopState,
    sample: DeviceSample,
    normal: Vec3,
    normal_force: float,
    counted: float,
    settings: LoopSettings,
) -> tuple[float, float]:
    """Return the damping of the passivity layer [N s/m], and the damped normal force [N]."""
    memory, speed_in = state.passivity, -dot(normal, sample.velocity)
    # Models that answer at once make no energy, and their loop is stable without damping
    # (science 3.15). The account is kept for the moment at which they no longer answer.
    owed = (1.0 - share_answered(state.replica, state.trust.share)) * memory.owed
    if state.replica is not None:  # unless they drive the hand
        owed += beyond(state.trust)
    return dissipate(owed, memory.damping, normal_force, speed_in, counted, settings.max_damping)


def _friction_force(
    state: LoopState,
    sight: Sight,
    moved: Vec3,
    normal: Vec3,
    local: LocalForce,
    k_h: float,
    C: Compliance3,
    pace: float,
    settings: LoopSettings,
) -> FrictionState:
    """Return the state of the friction after this period, which contains its force [N]."""
    if state.sight is not None and state.friction.touching:
        # The anchor lies `depth` away from the tip, along the normal of the last period. If the
        # surface has turned since, a part of that depth now lies along the surface.
        moved = sub(moved, scale(state.normal, max(0.0, state.depth)))
    return friction_step(
        state.friction,
        moved,
        sight.u_others,
        normal,
        local.normal_force,
        C,
        settings.friction,
        min(1.0, k_h * sight.c_ii),
        settings.max_stiffness,
        0.5 * pace,
    )
