"""Whole seconds of one haptic loop, in virtual time: patches in, forces out."""

from __future__ import annotations

import itertools
import math
import random
from collections import deque
from dataclasses import asdict, dataclass, replace
from typing import Any

from cohaptic.control.law import Law
from cohaptic.control.proportional_integral import Thresholds
from cohaptic.hands import Hand, HandState, move
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.vec import ZERO, norm, scale, unit
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop_config import law_settings, silent_after
from cohaptic_client.safety import Mode, SafetyLimits
from cohaptic_client.step import LoopSettings, LoopState, Output, receive, step

T = 0.001  # s
TICK, DELAY = 16, 0.03  # periods between ticks; from a tick to the arrival of its patch [s]
PERIOD = TICK * T
NORMAL = unit((-0.9, 0.3, 0.1))
# Of a patch, those that the loop reads.
PATCH_FIELDS = ("tick", "law", "x_free", "c_ii", "k_h", "integral_gain", "own_force", "u_others")


@dataclass(frozen=True, slots=True)
class Play:
    """One hand at a scripted surface, which others move and which carries the hand's own force.

    Args:
        name: Of the vector.
        laws: From which time [s] patches are for which law.
        curvature: Of the surface [1/m]; 0 for a plane.
        way: Where the hand wants to be, over time: t [s], depth [m].
        silence: No patch between these times; ticks then count from 1 again [s].
        others: How far others push the surface in and out [m].
    """

    name: str
    laws: tuple[tuple[float, Law], ...]
    curvature: float
    way: tuple[tuple[float, float], ...]
    silence: tuple[float, float] = (9.0, 9.0)
    others: float = 0.004


PLAYS = (
    Play("another pushes", ((0.0, Law.PREDICTIVE),), 0.0, ((0, -0.01), (0.3, 0.02), (1.2, 0.02))),
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
    Play(
        "the server falls silent",
        ((0.0, Law.PREDICTIVE),),
        8.0,
        ((0, -0.01), (0.3, 0.02), (1.5, 0.02)),
        silence=(0.5, 0.85),
    ),
    Play("too fast", ((0.0, Law.PREDICTIVE),), 0.0, ((0, -0.01), (0.3, 0.02), (0.5, 1.5))),
)


def path(way: tuple[tuple[float, float], ...], t: float) -> float:
    """Depth on the straight lines between the points of a way [m]."""
    for (t0, a), (t1, b) in itertools.pairwise(way):
        if t < t1:
            return a + (b - a) * max(0.0, t - t0) / (t1 - t0)
    return way[-1][1]


def patch_of(play: Play, t: float, tick: int, own_force: float, c_ii: float) -> Patch:
    """The patch of a tick at `t` [s], of a body that carries `own_force` [N] of the hand."""
    law = [law for since, law in play.laws if since <= t][-1]
    u_others = round(play.others * math.sin(15.0 * t), 6)
    return Patch(
        tick=tick, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0,
        geometry=Geometry.SPHERE if play.curvature else Geometry.PLANE, law=law,
        x_free=scale(NORMAL, 0.1 + u_others), normal=NORMAL, curvature=play.curvature,
        k_o=1.0 / c_ii, k_o_coupled=0.8 / c_ii, c_ii=c_ii,
        k_h=round((0.9 if law is not Law.PI else 0.3) / c_ii, 3),
        integral_gain=0.0 if law is Law.PROPORTIONAL else 3000.0,
        own_force=own_force, u_others=u_others,
    )  # fmt: skip


def play_out(play: Play) -> dict[str, Any]:
    """A play, period by period: what came in, and every twenty-fifth of what came out."""
    limits = replace(SafetyLimits(), silent_after=silent_after(PERIOD), engage_time=0.2)
    settings = LoopSettings(
        PERIOD, limits, law_settings(Thresholds(), PERIOD, limits), max_damping=5.0
    )
    hand, rng = Hand(), random.Random(5)
    start = scale(NORMAL, 0.1 - play.way[0][1])
    state, tip, force = LoopState(), HandState(start, ZERO), ZERO
    under_way, came, rows = deque[tuple[float, Patch]](), list[dict[str, Any]](), list[Any]()
    tick, own_force = 0, 0.0
    for i in range(1500):
        now = round(i * T, 6)
        if i % TICK == 0:
            silent = play.silence[0] <= now < play.silence[1]
            tick = 0 if silent else tick + 1
            if not silent:
                patch = patch_of(play, now, tick, own_force, round(rng.uniform(0.0038, 0.0042), 6))
                under_way.append((round(now + DELAY, 6), patch))
        while under_way and under_way[0][0] <= now:
            at, patch = under_way.popleft()
            came.append({"at": at} | {f: getattr(patch, f) for f in PATCH_FIELDS})
            came[-1]["law"] = patch.law.value
            state = receive(state, patch, now, settings)
        target = scale(NORMAL, 0.1 - path(play.way, now))
        tip = move(tip, hand, target, force, T)
        state, out = step(state, DeviceSample(tip.position, tip.velocity), now, settings)
        force, own_force = out.force, round(norm(out.on_body), 6)
        if i % 25 == 24:
            rows.append(row(i, tip, state, out))
    return {
        "name": play.name,
        "simulation_period": PERIOD,
        "limits": asdict(limits),
        "max_damping": settings.max_damping,
        "release_time": settings.law.release_time,
        "hand": asdict(hand),
        "normal": NORMAL,
        "curvature": play.curvature,
        "way": play.way,
        "patches": came,
        "rows": rows,
    }


def row(i: int, tip: HandState, state: LoopState, out: Output) -> dict[str, Any]:
    """What a period ended with."""
    return {
        "i": i,
        "probe": tip.position,
        "force": out.force,
        "on_body": out.on_body,
        "normal_force": out.local.normal_force,
        "felt_from_others": out.local.felt_from_others,
        "damping_force": out.damping_force,
        "silent": out.silent,
        "k_h": state.k_h,
        "owed": state.passivity.owed,
        "scale": state.safety.scale,
        "engaged": state.safety.mode is Mode.ENGAGED,
    }
