"""Inputs and outputs of the local control law, which its second language must reproduce."""

from __future__ import annotations

import math
import random
from dataclasses import asdict
from typing import Any

import numpy as np

from cohaptic.control.friction import NO_FRICTION, Compliance3, friction_step, normal_shift
from cohaptic.control.geometry import LocalSurface, Sight, blend, difference, shift
from cohaptic.control.law import Law, pressed_depth
from cohaptic.control.laws.model import Gains, LawSettings, Thresholds
from cohaptic.control.laws.pi import IntegralState
from cohaptic.control.stability.single_contact import (
    elastic_object,
    integral_model,
    lifted_radius,
    proportional_model,
)
from cohaptic.control.stability.stable_set import closed_edges, lifted_edges
from cohaptic.vec import ZERO, Vec3, add, scale, unit
from cohaptic_client.loop.passivity import Passivity, dissipate, given_energy, observe
from cohaptic_client.loop.safety import Mode, SafetyLimits, SafetyState
from cohaptic_client.network.timing import LinkTiming, Pacer
from tests.client.loop.safety_cases import guard

T, PERIOD = 0.001, 0.016  # s


def pick(rng: random.Random, low: float, high: float) -> float:
    """A number with few digits, which is the same in every language."""
    return round(rng.uniform(low, high), 6)


def point(rng: random.Random, size: float) -> Vec3:
    return (pick(rng, -size, size), pick(rng, -size, size), pick(rng, -size, size))


def a_sight(rng: random.Random, depth: float) -> Sight:
    normal = unit(point(rng, 1.0))
    # The body has mostly been pressed; other normals and friction turn its force.
    own_force = add(scale(normal, pick(rng, 0.0, 3.0)), point(rng, 0.5))
    return Sight(depth, normal, pick(rng, 1e-3, 1e-2), own_force, point(rng, 4e-3))


def surfaces() -> list[dict[str, Any]]:
    """Planes and spheres as probes see them, and the way from one sight to another."""
    rng, rows = random.Random(1), list[dict[str, Any]]()
    for curvature in (0.0, 12.5, -8.0, 1e-9, 40.0):
        for _ in range(4):
            x_free, normal = point(rng, 0.1), unit(point(rng, 1.0))
            surface = LocalSurface(
                x_free, normal, curvature, 0.004, point(rng, 3.0), point(rng, 0.01)
            )
            probe = add(surface.x_free, point(rng, 0.03))
            other, s = a_sight(rng, pick(rng, -0.01, 0.02)), pick(rng, 0.0, 1.0)
            seen = surface.look(probe)
            rows.append(
                {
                    "surface": asdict(surface),
                    "probe": probe,
                    "sight": asdict(seen),
                    "other": asdict(other),
                    "share": s,
                    "blend": asdict(blend(seen, other, s)),
                    "shift": asdict(shift(seen, difference(other, seen))),
                }
            )
    return rows


def presses() -> list[dict[str, Any]]:
    """Each law through a press, a rest and a release."""
    rng, rows = random.Random(2), list[dict[str, Any]]()
    settings = LawSettings(Thresholds(0.3e-3, 0.8e-3, 1.5), 0.12, 6.0)
    for law in Law:
        for k_h, integral_gain in ((200.0, 0.0), (90.0, 4000.0), (140.0, 30000.0)):
            memory: object = None
            steps, before = list[dict[str, Any]](), 0.0
            for i in range(25):
                depth = round(0.02 * math.sin(0.25 * i) - 0.002, 6)
                # The limit of an integral is at work in every second period.
                moved_in, limit = round(0.5 * (depth - before), 6), 0.02 if i % 2 else 10.0
                before = depth
                sight = a_sight(rng, depth)
                gains, dt = Gains(k_h, integral_gain), pick(rng, 5e-4, 3e-3)
                memory, force = law.model.force(memory, sight, gains, dt, settings, moved_in, limit)
                state = memory if isinstance(memory, IntegralState) else IntegralState()
                steps.append(
                    {
                        "sight": asdict(sight),
                        "dt": dt,
                        "moved_in": moved_in,
                        "most": limit,
                        "pressed_depth": pressed_depth(law, sight),
                        "memory": state._asdict(),
                        "force": asdict(force),
                    }
                )
            rows.append(
                {
                    "law": law.value,
                    "gains": asdict(Gains(k_h, integral_gain)),
                    "settings": settings._asdict() | {"thresholds": settings.thresholds._asdict()},
                    "steps": steps,
                }
            )
    return rows


def energies() -> list[dict[str, Any]]:
    """The passivity layer: energy comes, damping takes it out, in contact and out of it."""
    rng, rows, memory = random.Random(3), list[dict[str, Any]](), Passivity()
    for i in range(300):
        law = {
            "stored": max(0.0, round(0.02 * math.sin(0.05 * i), 6)),
            "ratio": pick(rng, 0.0, 1.0),
            "scale": 0.0 if i % 50 == 49 else pick(rng, 0.2, 1.0),
        }
        given = {
            "force": 3.0 if i % 70 < 40 else max(0.0, round(3.0 * math.sin(0.05 * i), 6)),
            "speed_in": pick(rng, -0.2, 0.2),
            "work": pick(rng, -6e-4, 4e-4),
            "from_body": pick(rng, -4e-4, 3e-4),
            "dt": 0.0 if i == 0 else pick(rng, 5e-4, 2e-3),
        }
        damping, damped = dissipate(
            memory.owed, memory.damping, given["force"], given["speed_in"], given["dt"], 6.0
        )
        stored = given_energy(**law)
        more = stored - memory.stored
        owed = observe(memory.owed, given["work"], more, given["from_body"], given["dt"])
        memory = Passivity(owed, damping, stored)
        rows.append({"spring": law} | given | {"damped": damped, "after": asdict(memory)})
    return rows


def guards() -> list[dict[str, Any]]:
    """The safety layer: steps of the wanted force both ways, late periods, a silent server; a
    stall, a hand too fast, again while it is let go, and a force that is no number (null).
    """
    rng, rows, state = random.Random(6), list[dict[str, Any]](), SafetyState()
    limits, now, wanted = SafetyLimits(max_force=6.0, engage_time=0.05), 0.0, ZERO
    for i in range(500):
        now = round(now + LATE.get(i, T), 6)
        if i % 20 == 10:
            wanted = ZERO if i % 60 == 50 else point(rng, 6.0)
        asked = (wanted[0], math.nan, wanted[2]) if i == 430 else wanted
        velocity = (2.0, 0.0, 0.0) if i in (140, 152) else point(rng, 0.2)
        silent = 200 <= i < 240 or 330 <= i < 420
        state = guard(state, asked, now=now, velocity=velocity, silent=silent, limits=limits)
        given = {
            "now": now,
            "wanted": [c if math.isfinite(c) else None for c in asked],
            "velocity": velocity,
            "silent": silent,
        }
        seen = {name: getattr(state, name) for name in ("force", "scale", "fault", "left")}
        rows.append(given | seen | {"engaged": state.mode is Mode.ENGAGED})
    return rows


# s; of a period that does not take T: late ones, one that takes no time, a stall.
LATE = {95: 0.0015, 97: 0.006, 115: 0.015, 118: 0.0, 270: 0.05, 345: 0.01}


def slides() -> list[dict[str, Any]]:
    """Friction: a tip that sticks, slips and lets go, on material that others drag along."""
    rng, rows, state = random.Random(7), list[dict[str, Any]](), NO_FRICTION
    A = np.array([[0.06, 0.01, -0.02], [0.0, 0.05, 0.015], [0.005, -0.01, 0.07]])
    mu, max_stiffness = 0.4, 300.0
    for i in range(240):
        normal = unit((0.2 * math.sin(0.02 * i), 0.1, 1.0))
        M = A @ A.T * (1.0 + 0.2 * math.sin(0.05 * i))
        C = Compliance3(*(round(float(M[i, j]), 9) for i, j in ENTRIES))
        # At first the material moves under a hand at rest, then both move.
        moved = ZERO if i < 80 else point(rng, 4e-4 if i % 60 < 40 else 2e-5)
        drag = 0.004 * math.sin(0.04 * i)
        material = (round(drag, 6), round(-0.5 * drag, 6), 0.001)
        # In contact, light, out of it.
        f_n = 0.0 if i % 100 > 90 else (0.02 if i % 50 > 40 else 2.0)
        fraction, limit = 1.0 if i < 120 else 0.7, 0.01 if i < 160 else 0.002
        aside = normal_shift(state, normal, C)
        state = friction_step(
            state, moved, material, normal, f_n, C, mu, fraction, max_stiffness, limit
        )
        rows.append(
            {
                "moved": moved,
                "material": material,
                "normal": normal,
                "normal_force": f_n,
                "C": C,
                "mu": mu,
                "fraction": fraction,
                "max_stiffness": max_stiffness,
                "max_change": limit,
                "aside": aside,
                # Without those of the backstop and of rows, which the page has not.
                "after": {
                    key: value
                    for key, value in state._asdict().items()
                    if key not in ("stiffness", "slips")
                },
            }
        )
    return rows


ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of a Compliance3


def links() -> list[dict[str, Any]]:
    """Round trip, clock offset and the phase of sending, patch after patch."""
    rng, rows = random.Random(4), list[dict[str, Any]]()
    timing, pacer = LinkTiming(), Pacer(PERIOD, 10.0)
    for i in range(150):
        t_client = round(10.0 + 0.1 * i, 6)
        # It becomes slower: the shortest round trips are old ones.
        up, down = pick(rng, 0.01, 0.05) + 2e-4 * i, pick(rng, 0.02, 0.04)
        wait = pick(rng, 0.0, PERIOD)
        now, t_server = t_client + up + wait + down, t_client + up + wait + 500.0
        timing = timing.measured(t_client=t_client, t_server=t_server, sample_wait=wait, now=now)
        pacer = pacer.reported(t_client, wait).sent(now)
        rows.append(
            {
                "t_client": t_client,
                "t_server": t_server,
                "sample_wait": wait,
                "now": now,
                "round_trip": timing.round_trip,
                "jitter": timing.jitter,
                "clock_offset": timing.clock_offset,
                "due": pacer.due,
            }
        )
    return rows


def stabilities() -> dict[str, Any]:
    """The lifted system's radius, and edges of the stable set."""
    radii = [
        {
            "k_h": k_h,
            "step_gain": gain,
            "k_o": 100.0,
            "b_o": b_o,
            "rate_ratio": n,
            "delay_samples": delay,
            "radius": lifted_radius(
                proportional_model(k_h) if gain is None else integral_model(k_h, gain / T, T),
                elastic_object(100.0, b_o),
                n,
                delay,
            ),
        }
        for k_h in (40.0, 110.0)
        for gain in (None, 0.4, 3.0)
        for b_o in (0.0, 20.0)
        for n, delay in ((1, 0), (1, 7), (16, 0), (16, 5), (16, 40), (1, 31))
    ]
    edges = list[dict[str, Any]]()
    for k_h in (0.1, 50.0, 95.0, 150.0, 250.0, 310.0):
        for delay in (0, 1, 3):
            low, high = lifted_edges(np.array([k_h]), 100.0, delay_samples=delay)
            closed_low, closed_high = closed_edges(np.array([k_h]), 100.0)
            edges.append(
                {
                    "k_h": k_h,
                    "k_o": 100.0,
                    "delay": delay,
                    "lifted": None if math.isnan(low[0]) else [low[0], high[0]],
                    "closed": None
                    if math.isnan(closed_low[0])
                    else [closed_low[0], closed_high[0]],
                }
            )
    return {"radii": radii, "edges": edges}
