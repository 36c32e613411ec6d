"""Whole seconds of one haptic loop, in virtual time: patches in, forces out."""

from __future__ import annotations

import itertools
import math
import random
from collections import deque
from dataclasses import asdict, dataclass, replace
from typing import Any

from cohaptic.control.friction import Compliance3, times
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.simulated.hand import Hand, HandState, move
from cohaptic.vec import ZERO, Vec3, add, dot, scale, unit
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.config import law_settings, silent_after
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.safety import Mode, SafetyLimits
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step

T = 0.001  # s
TICK, DELAY = 16, 0.03  # periods between ticks; from a tick to the arrival of its patch [s]
PERIOD = TICK * T
NORMAL = unit((-0.9, 0.3, 0.1))
ALONG = unit((0.3, 0.9, 0.0))  # in the surface
# Of a patch, those that the loop reads.
PATCH_FIELDS = (
    "tick", "t_server", "law", "x_free", "c_ii", "k_h", "integral_gain", "own_force", "u_others",
    "compliance",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Play:
    """One hand at a scripted surface, which others move and which carries the hand's own force.

    Args:
        name: Of the vector.
        laws: From which time [s] patches are for which law.
        curvature: Of the surface [1/m]; 0 for a plane.
        way: Where the hand wants to be, over time: t [s], depth [m].
        silence: No patch between these times; ticks then count from 1 again [s].
        losses: No patch between any of these times; ticks go on [s].
        wavers: Largest lateness of a patch, whose order stays [s].
        others: How far others push the material in and out, and along the surface [m].
        shove: From 0.6 s on, as far others have pushed it in at once [m].
        max_stiffness: Of the device [N/m].
        friction: mu; with it the hand slides to and fro.
        left_out: Periods in which the loop was not run: a late one, and one later still.
    """

    name: str
    laws: tuple[tuple[float, Law], ...]
    curvature: float
    way: tuple[tuple[float, float], ...]
    silence: tuple[float, float] = (9.0, 9.0)
    losses: tuple[tuple[float, float], ...] = ()
    wavers: float = 0.0
    others: float = 0.004
    shove: float = 0.0
    max_stiffness: float = 2000.0
    friction: float = 0.0
    left_out: tuple[int, ...] = ()


ALONE, HELD = ((0.0, Law.PREDICTIVE),), ((0, -0.01), (0.3, 0.02), (1.5, 0.02))
PLAYS = (
    Play("another pushes", ALONE, 0.0, ((0, -0.01), (0.3, 0.02), (1.2, 0.02))),
    # Faster than a hand may be moved by others: the surface is held back, in and out.
    Play("another jolts", ALONE, 6.0, HELD, others=0.008, shove=0.012),
    Play(
        "laws change",
        ((0.0, Law.PREDICTIVE), (0.4, Law.PI), (0.7, Law.PROPORTIONAL), (0.8, Law.PREDICTIVE)),
        10.0,
        ((0, -0.01), (0.3, 0.02), (1.2, 0.015), (1.4, -0.02)),
        others=0.002,
    ),
    # Back in the middle of a change, and a change while hardly anything is felt.
    Play(
        "laws change back",
        ((0.0, Law.PI), (0.4, Law.PREDICTIVE), (0.48, Law.PI), (0.9, Law.PROPORTIONAL)),
        10.0,
        ((0, -0.01), (0.3, 0.02), (0.8, 0.02), (0.95, 0.0005), (1.4, 0.0008)),
        others=0.0,
    ),
    Play("pi lets go", ((0.0, Law.PI),), 5.0, ((0, -0.01), (0.3, 0.02), (0.8, 0.02), (0.9, -0.02))),
    Play("the server falls silent", ALONE, 8.0, HELD, silence=(0.5, 0.85)),
    # The first gap fades the force; the second, nearly as long, is the link's way.
    Play("patches are lost", ALONE, 8.0, HELD, losses=((0.4, 0.56), (0.9, 1.04))),
    Play("the link wavers", ALONE, 5.0, HELD, wavers=0.07, losses=((0.9, 0.94),)),
    Play("a device softer than the object", ALONE, 0.0, HELD, max_stiffness=150.0),
    # Two late periods; then a fault while the hand is pressed, and back from outside.
    Play(
        "the loop stands still",
        ALONE,
        0.0,
        ((0, -0.01), (0.3, 0.02), (0.7, 0.02), (0.8, -0.01), (0.9, -0.01), (1.2, 0.01)),
        left_out=(450, 500, 501, 502, 503, *range(600, 640)),
    ),
    Play("too fast", ALONE, 0.0, ((0, -0.01), (0.3, 0.02), (0.5, 0.02), (0.6, 1.5))),
)
# Of the safety layer's limits: for devices with motors, which a page has not.
NOT_THE_PAGES = ("stale", "latch", "dead_man", "external_rate")
ROUGH = Play("along the surface", ALONE, 4.0, HELD, friction=0.3, losses=((0.6, 0.75),))


def path(way: tuple[tuple[float, float], ...], t: float) -> float:
    """Depth on the straight lines between the points of a way [m]."""
    for (t0, a), (t1, b) in itertools.pairwise(way):
        if t < t1:
            return a + (b - a) * max(0.0, t - t0) / (t1 - t0)
    return way[-1][1]


def tip_wanted(play: Play, t: float) -> Vec3:
    """Where the hand wants to be [m]."""
    aside = 0.0 if play.friction == 0.0 else round(0.004 * math.sin(9.0 * t), 9)
    return add(scale(NORMAL, 0.1 - path(play.way, t)), scale(ALONG, aside))


def patch_of(play: Play, t: float, tick: int, own_force: Vec3, c_ii: float) -> Patch:
    """The patch of a tick at `t` [s], of a body that carries `own_force` [N] of the hand."""
    law = [law for since, law in play.laws if since <= t][-1]
    lift = round(play.others * math.sin(15.0 * t) - (play.shove if t >= 0.6 else 0.0), 6)
    drag = round(0.5 * play.others * math.sin(11.0 * t), 6)
    compliance = None
    if play.friction > 0.0:
        # Softer along the surface, and a force along x moves the contact along y, too.
        compliance = Compliance3(1.2 * c_ii, 1.1 * c_ii, c_ii, 0.1 * c_ii, 0.0, -0.05 * c_ii)
        c_ii = dot(NORMAL, times(compliance, NORMAL))
    fraction = {Law.PREDICTIVE: 1.0, Law.PI: 0.3, Law.PROPORTIONAL: 0.9}[law]
    return Patch(
        tick=tick, seq=0, t_server=t, t_client=0.0, sample_wait=0.0,
        geometry=Geometry.SPHERE if play.curvature else Geometry.PLANE, law=law,
        x_free=scale(NORMAL, 0.1 + lift), normal=NORMAL, curvature=play.curvature, c_ii=c_ii,
        k_h=min(fraction / c_ii, play.max_stiffness),
        integral_gain=3000.0 if law is Law.PI else 0.0,
        own_force=own_force, u_others=add(scale(NORMAL, lift), scale(ALONG, drag)),
        compliance=compliance,
    )  # fmt: skip


def play_out(play: Play) -> dict[str, Any]:
    """A play, period by period: its inputs, and every twenty-fifth output."""
    limits = replace(SafetyLimits(), silent_after=silent_after(PERIOD), engage_time=0.2)
    settings = LoopSettings(
        PERIOD,
        limits,
        law_settings(Thresholds(), PERIOD, limits),
        max_damping=5.0,
        friction=play.friction,
        max_stiffness=play.max_stiffness,
    )
    hand, rng, lateness, last = Hand(), random.Random(5), random.Random(8), 0.0
    state, tip, force = LoopState(), HandState(tip_wanted(play, 0.0), ZERO), ZERO
    under_way, came, rows = deque[tuple[float, Patch]](), list[dict[str, Any]](), list[Any]()
    tick, own_force = 0, ZERO
    for i in range(1500):
        now = round(i * T, 6)
        if i % TICK == 0:
            silent = play.silence[0] <= now < play.silence[1]
            tick = 0 if silent else tick + 1
            c_ii = round(rng.uniform(0.0038, 0.0042), 6)
            patch = patch_of(play, now, max(1, tick), own_force, c_ii)
            if not silent and not any(a <= now < b for a, b in play.losses):
                late = lateness.uniform(0.0, play.wavers)
                last = max(last, round(now + DELAY + late, 6))
                under_way.append((last, patch))
        tip = move(tip, hand, tip_wanted(play, now), force, T)
        if i in play.left_out:
            continue
        while under_way and under_way[0][0] <= now:
            at, patch = under_way.popleft()
            came.append({"at": at} | {f: getattr(patch, f) for f in PATCH_FIELDS})
            came[-1]["law"] = patch.law.value
            state = receive(state, patch, now, settings)
        state, out = step(state, DeviceSample(tip.position, tip.velocity), now, settings)
        force = out.force
        own_force = (round(out.on_body[0], 6), round(out.on_body[1], 6), round(out.on_body[2], 6))
        if i % 25 == 24 or i - 1 in play.left_out:
            rows.append(row(i, tip, state, out))
    return {
        "name": play.name,
        "simulation_period": PERIOD,
        "limits": {k: v for k, v in asdict(limits).items() if k not in NOT_THE_PAGES},
        "max_damping": settings.max_damping,
        "max_stiffness": settings.max_stiffness,
        "friction": settings.friction,
        "release_time": settings.law.release_time,
        "hand": asdict(hand),
        "normal": NORMAL,
        "along": ALONG,
        "curvature": play.curvature,
        "way": play.way,
        "left_out": play.left_out,
        "patches": came,
        "rows": rows,
    }


def row(i: int, tip: HandState, state: LoopState, out: Period) -> dict[str, Any]:
    """State at the end of a period."""
    return {
        "i": i,
        "probe": tip.position,
        "force": out.force,
        "on_body": out.on_body,
        "normal_force": out.local.normal_force,
        "felt_from_others": out.local.felt_from_others,
        "u_others": out.u_others,
        "damping_force": out.damping_force,
        "silent": out.silent,
        "patience": state.patience,
        "behind": state.playout.behind,
        "depth": state.depth if math.isfinite(state.depth) else None,  # before the first patch
        "k_h": state.k_h,
        "owed": state.passivity.owed,
        "stored": state.passivity.stored,
        "friction": state.friction.force,
        "scale": state.safety.scale,
        "left": state.safety.left,
        "engaged": state.safety.mode is Mode.ENGAGED,
    }
