"""One period of the haptic loop as a pure function: an hour of haptics is a `for` loop in a test.

The story of a period: the surface that is shown (`arrival`), the contact with it (`contact`), the
limits of the safety layer (`safety`), the balance of energy (`energy`), and the results.
"""

from __future__ import annotations

import math

from cohaptic.control.friction import anchor_of
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.vec import ZERO, Vec3, dot, norm, scale
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import is_silent, progress, shown
from cohaptic_client.loop.contact import NO_SURFACE, press
from cohaptic_client.loop.energy import balance
from cohaptic_client.loop.passivity import NOTHING_OWED
from cohaptic_client.loop.safety import guard
from cohaptic_client.loop.state import LoopSettings, LoopState, Output


def step(
    state: LoopState, sample: DeviceSample, now: float, settings: LoopSettings
) -> tuple[LoopState, Output]:
    """One haptic period: from a device's sample to the force it gets.

    Args:
        state: After the last period.
        sample: Of the device.
        now: Time of this period [s].
        settings: Of the loop.
    """
    limits = settings.limits
    dt = 0.0 if state.safety.now is None else max(0.0, now - state.safety.now)
    silent = is_silent(state, now, settings)
    share = progress(state, now, settings)
    sight = shown(state, sample.position, share)
    contact = NO_SURFACE
    if sight is not None:
        contact = press(state, sample, sight, share, dt, silent, settings)
    force = contact.requested_force
    safety = guard(
        state.safety, force, now=now, velocity=sample.velocity, silent=silent, limits=limits
    )
    size = contact.damped_force if contact.compliance is None else norm(force)
    given_ratio = norm(safety.force) / size if size > 0.0 else safety.scale
    passivity = NOTHING_OWED
    if settings.max_damping > 0.0 and sight is not None and state.sight is not None:
        passivity = balance(state, contact, state.sight, sight, safety, given_ratio, dt)
    after = LoopState(
        patch=state.patch,
        arrived=state.arrived,
        before=state.before,
        offset=state.offset,
        surface=state.surface,
        k_h_before=state.k_h_before,
        fade=contact.fade,
        normal_force=contact.local.normal_force,
        sight=sight,
        depth=contact.depth,
        probe=sample.position,
        normal=contact.normal,
        passivity=passivity,
        friction=contact.friction,
        compliance=contact.compliance,
        safety=safety,
        patience=state.patience,
    )
    output = Output(
        force=safety.force,
        on_body=on_body(contact.law_force, given_ratio, limits.max_force),
        anchor=told(anchor_of(contact.friction, sample.position, contact.normal, contact.depth)),
        local=contact.local,
        damping_force=contact.damped_force - contact.local.normal_force,
        u_others=dot(sight.u_others, sight.normal) if sight is not None else 0.0,
        silent=silent,
    )
    return after, output


def told(anchor: Vec3 | None) -> Vec3 | None:
    """An anchor as the server may hear of it: none that is no place within reach [m]."""
    if anchor is None or not norm(anchor) <= MAX_POSITION:  # NaN too
        return None
    return anchor


def on_body(force: Vec3, ratio: float, max_force: float) -> Vec3:
    """Force on the body: the share of law and friction that the hand has, and never more [N].

    Damping may take nearly all of the law's force, or double it, and is not the body's affair; and
    while a force still comes down to the law's, the body has the law's.

    Args:
        force: Of the law and the friction [N].
        ratio: Force that the hand is given over the one that was requested.
        max_force: Of the hand [N].
    """
    size = norm(force)
    if not size < math.inf:  # NaN too
        return ZERO
    share = min(1.0, ratio)
    return scale(force, max_force / size if size * share > max_force else share)
