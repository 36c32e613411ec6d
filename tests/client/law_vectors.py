"""Numbers in, numbers out: what the local control law does, for a second language to do too."""

from __future__ import annotations

import math
import random
from dataclasses import asdict
from typing import Any

import numpy as np

from cohaptic.control.geometry import LocalSurface, Sight, blend, difference, shift
from cohaptic.control.law import AT_REST, Gains, Law, LawSettings, local_force, pressed_depth
from cohaptic.control.proportional_integral import Thresholds
from cohaptic.control.stability import (
    elastic_object,
    integral_model,
    lifted_radius,
    proportional_model,
)
from cohaptic.control.stability_area import closed_edges, lifted_edges
from cohaptic.vec import ZERO, Vec3, add, unit
from cohaptic_client.pacing import Pacer
from cohaptic_client.passivity import Passivity, dissipate, observe
from cohaptic_client.safety import Mode, SafetyLimits, SafetyState, guard
from cohaptic_client.timing import LinkTiming

T, PERIOD = 0.001, 0.016  # s


def pick(rng: random.Random, low: float, high: float) -> float:
    """A number with few digits, which is the same in every language."""
    return round(rng.uniform(low, high), 6)


def point(rng: random.Random, size: float) -> Vec3:
    return (pick(rng, -size, size), pick(rng, -size, size), pick(rng, -size, size))


def a_sight(rng: random.Random, depth: float) -> Sight:
    normal = unit(point(rng, 1.0))
    return Sight(depth, normal, pick(rng, 1e-3, 1e-2), pick(rng, 0.0, 3.0), pick(rng, -4e-3, 4e-3))


def surfaces() -> list[dict[str, Any]]:
    """What probes see of planes and spheres, and what lies between two sights."""
    rng, rows = random.Random(1), list[dict[str, Any]]()
    for curvature in (0.0, 12.5, -8.0, 1e-9, 40.0):
        for _ in range(4):
            surface = LocalSurface(
                point(rng, 0.1), unit(point(rng, 1.0)), curvature, 0.004, 1.5, pick(rng, 0, 0.01)
            )
            probe = add(surface.x_free, point(rng, 0.03))
            other, s = a_sight(rng, pick(rng, -0.01, 0.02)), pick(rng, 0.0, 1.0)
            seen = surface.look(probe)
            rows.append(
                {
                    "surface": asdict(surface),
                    "probe": probe,
                    "sight": seen._asdict(),
                    "other": other._asdict(),
                    "share": s,
                    "blend": blend(seen, other, s)._asdict(),
                    "shift": shift(seen, difference(other, seen))._asdict(),
                }
            )
    return rows


def presses() -> list[dict[str, Any]]:
    """Each law through a press, a rest and a release."""
    rng, rows = random.Random(2), list[dict[str, Any]]()
    settings = LawSettings(Thresholds(0.3e-3, 0.8e-3, 1.5), 0.12, 6.0)
    for law in Law:
        for k_h, integral_gain in ((200.0, 0.0), (90.0, 4000.0), (140.0, 30000.0)):
            memory, steps = AT_REST, list[dict[str, Any]]()
            for i in range(25):
                depth = round(0.02 * math.sin(0.25 * i) - 0.002, 6)
                sight = a_sight(rng, depth)
                gains, dt = Gains(k_h, integral_gain), pick(rng, 5e-4, 3e-3)
                memory, force = local_force(law, memory, sight, gains, dt, settings)
                steps.append(
                    {
                        "sight": sight._asdict(),
                        "dt": dt,
                        "pressed_depth": pressed_depth(law, sight),
                        "memory": memory._asdict(),
                        "force": force._asdict(),
                    }
                )
            rows.append(
                {
                    "law": law.value,
                    "gains": Gains(k_h, integral_gain)._asdict(),
                    "settings": settings._asdict() | {"thresholds": settings.thresholds._asdict()},
                    "steps": steps,
                }
            )
    return rows


def energies() -> list[dict[str, Any]]:
    """The passivity layer: energy comes, damping takes it out."""
    rng, rows, owed, damping = random.Random(3), list[dict[str, Any]](), 0.0, 0.0
    for i in range(200):
        force = max(0.0, round(3.0 * math.sin(0.05 * i), 6))
        given = {
            "force": force,
            "own_force": pick(rng, 0.0, 3.0),
            "surface_moved": pick(rng, -1e-4, 2e-4),
            "speed_in": pick(rng, -0.2, 0.2),
            "dt": pick(rng, 5e-4, 2e-3),
        }
        owed = observe(owed, force, given["own_force"], given["surface_moved"], given["dt"])
        seen = owed
        owed, damping, damped = dissipate(owed, damping, force, given["speed_in"], given["dt"], 6.0)
        after = Passivity(owed, damping)
        rows.append(given | {"seen": seen, "after": after._asdict(), "damped": damped})
    return rows


def guards() -> list[dict[str, Any]]:
    """The safety layer: steps of the wanted force, a silent server, a stall, a hand too fast."""
    rng, rows, state = random.Random(6), list[dict[str, Any]](), SafetyState()
    limits, now, wanted = SafetyLimits(max_force=6.0, engage_time=0.05), 0.0, ZERO
    for i in range(300):
        now = round(now + (0.05 if i == 220 else T), 6)
        if i % 20 == 10:
            wanted = ZERO if i % 60 == 50 else point(rng, 6.0)
        velocity = (2.0, 0.0, 0.0) if i == 140 else point(rng, 0.2)
        given = {"now": now, "wanted": wanted, "velocity": velocity, "silent": 160 <= i < 200}
        state = guard(
            state, wanted, now=now, velocity=velocity, silent=160 <= i < 200, limits=limits
        )
        engaged = state.mode is Mode.ENGAGED
        rows.append(
            given | {"force": state.force, "scale": state.scale, "engaged": engaged}
            | {"fault": state.fault}
        )  # fmt: skip
    return rows


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
