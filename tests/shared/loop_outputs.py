"""A minute of the haptic loop at random surfaces, and its scripted plays, in a process of its own.

The process is told whether to use compiled modules, since one cannot have both.
"""

from __future__ import annotations

import json
import math
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from cohaptic.compiled import PLAIN, describe, is_complete, use
from tests.give_up import give_up

ROOT = Path(__file__).parents[2]
NOT_COMPILED = 3  # exit status
PERIODS = 60_000  # a minute at 1 kHz
EACH = 5  # every fifth period is compared


def outputs_of_a_loop(*, compiled: bool) -> list[dict[str, float]]:
    """What the loop gave, in periods and plays; skips where it is to be compiled and is not."""
    environment = {**os.environ, PLAIN: "0" if compiled else "1"}
    environment["PYTHONPATH"] = os.pathsep.join(
        str(ROOT / side) for side in ("shared", "server", "client", "")
    )
    done = subprocess.run(
        [sys.executable, "-m", "tests.shared.loop_outputs", *(["compiled"] if compiled else [])],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == NOT_COMPILED:
        give_up(f"the loop is not compiled: {done.stderr}")
    assert done.returncode == 0, done.stderr
    outputs: list[dict[str, float]] = json.loads(done.stdout)
    return outputs


def random_minute() -> list[Any]:
    """Random patches of every law on a plane or sphere, and a hand that wanders through them."""
    # Here, because a module that is imported stays as it was then.
    from cohaptic.control.friction import Compliance3
    from cohaptic.control.law import Law
    from cohaptic.protocol.patch import Geometry
    from cohaptic.vec import unit
    from cohaptic_client.devices.device import DeviceSample
    from cohaptic_client.loop.arrival import receive
    from cohaptic_client.loop.safety import SafetyLimits
    from cohaptic_client.loop.state import LoopSettings, LoopState
    from cohaptic_client.loop.step import step
    from tests.client.plane import PLANE

    rng = random.Random(24)
    settings = LoopSettings(1.0 / 60.0, SafetyLimits(), max_damping=5.0, friction=0.3)
    state, rows, normal, aim = LoopState(), list[Any](), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    tip, before = [0.1, 0.0, 0.0], [0.1, 0.0, 0.0]
    for i in range(PERIODS):
        now = 10.0 + 0.001 * i
        if i % 16 == 0:
            turn = [n + 0.05 * rng.uniform(-1.0, 1.0) for n in normal]
            normal = unit((turn[0], turn[1], turn[2]))
            c = rng.uniform(1e-3, 1e-2)
            patch = replace(
                PLANE,
                tick=i // 16 + 1,
                geometry=rng.choice((Geometry.PLANE, Geometry.SPHERE)),
                law=list(Law)[i // 4000 % len(Law)],
                x_free=(0.002 * math.sin(now), 0.002 * math.cos(now), 0.0),
                normal=normal,
                curvature=rng.uniform(-10.0, 10.0),
                c_ii=c,
                k_h=rng.uniform(0.3, 1.0) / c,
                integral_gain=rng.uniform(0.0, 3000.0),
                own_force=(rng.uniform(-1.0, 1.0), 0.0, 0.0),
                u_others=(0.002 * math.sin(3.0 * now), 0.0, 0.001 * math.cos(now)),
                compliance=rng.choice((None, Compliance3(1.2 * c, 1.1 * c, c, 0.1 * c, 0.0, 0.0))),
            )
            if i // 500 % 9:  # half a second without patches, again and again
                state = receive(state, patch, now, settings)
        if i % 300 == 0:
            depth = rng.uniform(-0.02, 0.01)
            aim = (normal[0] * depth, normal[1] * depth, rng.uniform(-0.01, 0.01))
        before = tip
        tip = [x + 0.01 * (a - x) for x, a in zip(tip, aim, strict=True)]
        speed = [(x - b) / 0.001 for x, b in zip(tip, before, strict=True)]
        sample = DeviceSample((tip[0], tip[1], tip[2]), (speed[0], speed[1], speed[2]))
        state, out = step(state, sample, now, settings)
        if i % EACH == 0:
            rows.append([i, *out.force, *out.on_body, state.k_h, state.safety.scale])
    return rows


def looks_at_meshes() -> list[Any]:
    """What mesh surfaces look like to random probes, some far from all their vertices."""
    from cohaptic.control.geometry import LocalSurface
    from cohaptic.control.mesh_fit import RestSurface
    from cohaptic.control.mesh_surface import MeshSurface
    from cohaptic.vec import ZERO, unit
    from tests.neighbourhoods import facts

    rng = random.Random(25)
    places = [(0.01 * i, 0.01 * k, 0.0) for i in range(7) for k in range(7)]
    corners = [7 * i + k for i in range(6) for k in range(6)]
    faces = [face for c in corners for face in ((c, c + 7, c + 8), (c, c + 8, c + 1))]
    rest, rows = RestSurface(places, faces), list[Any]()
    for _ in range(200):
        normal = unit((rng.gauss(0.0, 0.1), rng.gauss(0.0, 0.1), 1.0))
        x_free = (rng.uniform(0.0, 0.06), rng.uniform(0.0, 0.06), rng.gauss(0.0, 0.001))
        base = LocalSurface(x_free, normal, rng.uniform(-20.0, 20.0), 4e-3, ZERO, ZERO)
        near = rng.sample(range(len(places)), rng.choice((1, 3, 40)))
        moved = [[rng.gauss(0.0, 0.001) for _ in range(3)] for _ in near]
        reported = facts(
            (k, x, y, z, 2e-3) for k, (x, y, z) in zip(sorted(near), moved, strict=True)
        )
        surface = MeshSurface(rest, base, reported)
        for depth in (0.0, 0.002, 0.02, 0.2, 2.0):
            probe = [x - depth * n for x, n in zip(x_free, normal, strict=True)]
            seen = surface.look((probe[0], probe[1], probe[2]))
            rows.append([seen.depth, *seen.normal, seen.c_ii])
    return rows


def numbers(name: str, value: Any) -> Iterator[tuple[str, float]]:
    """Every number in nested lists, tuples and dictionaries, with its place."""
    if value is None:
        return
    if isinstance(value, dict):
        parts = cast("dict[object, Any]", value)
    elif isinstance(value, list | tuple):
        parts = dict(enumerate(cast("list[Any]", value)))
    else:
        yield name, float(value)
        return
    for key, part in parts.items():
        yield from numbers(f"{name}.{key}", part)


def main() -> None:
    """Entry point of the process."""
    if "compiled" in sys.argv:
        use("loop")
        if not is_complete("loop"):
            print(describe("loop"), file=sys.stderr)
            sys.exit(NOT_COMPILED)
    rows = random_minute() + looks_at_meshes()
    from tests.client.loop.plays import PLAYS, ROUGH, play_out

    plays = [play_out(play) for play in (*PLAYS, ROUGH)]
    rows += [row for play in plays for row in play["rows"]]
    json.dump([dict(numbers("", row)) for row in rows], sys.stdout)


if __name__ == "__main__":
    main()
