"""What a visitor sees and feels of another on the bodies that can be served as they come.

    python benchmarks/default_object.py [--ticks 200] [--json FILE]

The balloon, linear and under finite deformation, and the two objects of `examples/`, held as in
the demo (`--fix "z < 15%"`). Two hands stand in the horizontal plane through the middle of the
body, 60, 90, 120 and 180 degrees apart, where a ray from outside meets it, at eight azimuths of the
first one; places on what is held, or too near to each other, do not count (`places`).

- *dent*: of the own surface under 2 N, and its share of the body's largest size;
- *other*: C_ij / C_ii, how the surface moves under the other hand for that; medians, over `places`;
- *moved*: share of the surface that moves by 0.5 mm, a twentieth of the page's first legend;
- *felt*: force that the second hand feels of the first at the demo's press (the first 20 mm deep
  and the second 10 mm, or less where the body is thin), in equilibrium, without a network; and
  *at the demo's places*, those that the demo chooses;
- *prepared*, *starts*: seconds to make the body the first time and again, with what was kept;
- *tick*: median of the two hands at the 90 degrees, at rest. These depend on the machine.
"""

from __future__ import annotations

import argparse
import math
import os
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
from cohaptic.control.law import Law
from cohaptic.errors import BodyError
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.thin_parts import depth_under
from cohaptic_server.numeric import Floats, Ints, vec3
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.touchable import is_file
from cohaptic_server.world.contact import locate
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from cohaptic_tools.demo.places import placement_at
from cohaptic_tools.demo.scene import PRESS_DEPTH, Scene, reference
from cohaptic_tools.demo.set_up import FIX, set_up

EXAMPLES = Path(__file__).parents[1] / "examples"
APART = (60.0, 90.0, 120.0, 180.0)  # degrees
FIRST = 8  # azimuths of the first hand
FORCE = 2.0  # N
MOVED = 0.5e-3  # m
LEAST_COMPLIANCE = 1e-5  # m/N; what gives way less is held
PERIOD = 1.0 / 60.0  # s
WARM_UP = 20  # ticks that do not count


@dataclass(frozen=True, slots=True)
class Candidate:
    """A body by the options with which it is served.

    Args:
        label: In the table.
        name: Name of the body, or its file.
        nonlinear: Whether the deformation is finite.
    """

    label: str
    name: str
    nonlinear: bool = False


CANDIDATES = (
    Candidate("balloon", "balloon"),
    Candidate("balloon --nonlinear", "balloon", nonlinear=True),
    Candidate("torus.stl", str(EXAMPLES / "torus.stl")),
    Candidate("organ.ply", str(EXAMPLES / "organ.ply")),
)


def seen_from(body: Body, azimuth: float) -> int:
    """Vertex at which a horizontal ray to the middle of the body meets it.

    Args:
        body: At rest.
        azimuth: From where the ray comes [degrees].
    """
    x = body.mesh.vertices
    middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
    out = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
    along = (x - middle) @ out
    beside = np.linalg.norm(x - middle - along[:, None] * out, axis=1)
    near = np.flatnonzero(beside <= max(body.contact_radius, 1.05 * float(beside.min())))
    return int(near[np.argmax(along[near])])


def pairs(body: Body, apart: float) -> list[Ints]:
    """Pairs of vertices where two hands have room to press, shape (2,) each."""
    found: list[Ints] = []
    for azimuth in np.arange(FIRST) * 360.0 / FIRST:
        pair = np.array([seen_from(body, azimuth), seen_from(body, azimuth + apart)])
        soft = placement_at(body, pair, PRESS_DEPTH)
        own = [moved(body, int(k))[1] for k in pair]
        if min(own) > LEAST_COMPLIANCE * FORCE and soft.distances[1] > 2.0 * body.contact_radius:
            found.append(pair)
    return found


def moved(body: Body, vertex: int, other: int | None = None) -> tuple[Floats, float, float]:
    """Where the surface goes under `FORCE` at a vertex.

    Args:
        body: At rest.
        vertex: Under the force.
        other: Place of another hand; None for the same.

    Returns:
        Displacement of every vertex, shape (n, 3) [m]; of the pressed contact, inwards, and of the
        other one along its own inward direction [m].
    """
    mesh = body.mesh
    still = np.zeros_like(mesh.vertices)
    own, theirs = (
        locate(mesh, mesh.vertices[k], still, radius=body.contact_radius).load(0.0)
        for k in (vertex, vertex if other is None else other)
    )
    field = body.respond([replace(own, force=FORCE)]).displacement_of(np.arange(len(still)))
    here, there = (
        float(load.weights @ field[load.vertices] @ load.direction) for load in (own, theirs)
    )
    return field, here, there


def felt(body: Body, pair: Ints) -> float:
    """Force that the second hand feels of the first at the demo's press [N]; nan if they slide."""
    placement = placement_at(body, pair, float(depth_under(body.mesh, pair).min()))
    return felt_in(body, Scene(2, places=placement.places, depth=placement.depth))


def felt_in(body: Body, scene: Scene) -> float:
    """The same of a scene."""
    try:
        return float(reference(scene, body, pressed=True).felt_from_others[1])
    except BodyError:
        return float("nan")


def tick(body: Body, pair: Ints, ticks: int) -> float:
    """Median time of a tick with two hands that press 3 mm deep and hold still [s]."""
    touched, state = TouchedBody(body), WorldState()
    x, out = body.mesh.vertices[pair], body.mesh.normals[pair]
    taken: list[float] = []
    for k in range(WARM_UP + ticks):
        touches = [
            Touch(
 who=Participant(user=i + 1, law=Law.PREDICTIVE, max_stiffness=1000.0, max_force=10.0),
                probe=vec3(x[i] - 3e-3 * out[i]), force=vec3(out[i]), seq=k + 1,
                tick=max(0, k - 1), t_client=k * PERIOD, arrived=0.0,
            )
            for i in range(2)
        ]  # fmt: skip
        start = time.perf_counter()
        state, _ = advance(touched, state, touches, now=k * PERIOD, dt=PERIOD)
        taken.append(time.perf_counter() - start)
    return float(np.median(taken[WARM_UP:]))


def made(candidate: Candidate) -> tuple[float, Body, Scene]:
    """Seconds to make a body with the demo's places, the body and the demo's scene."""
    fix = FIX if is_file(candidate.name) else ""
    source = ObjectFile(Path(candidate.name), fix=fix)
    begin = time.perf_counter()
    body, scene, _ = set_up(
        Scene(2), candidate.name, source,
        nonlinear=candidate.nonlinear, progress=lambda phase, fraction: None,
    )  # fmt: skip
    return time.perf_counter() - begin, body, scene


def measure(candidate: Candidate, ticks: int) -> list[dict[str, float | str]]:
    """One row for each angle between the hands."""
    prepared, *_ = made(candidate)
    starts, body, scene = made(candidate)
    x = body.mesh.vertices
    size = float(np.ptp(x, axis=0).max())
    rows: list[dict[str, float | str]] = []
    for apart in APART:
        chosen = pairs(body, apart)
        fields = [moved(body, int(first), int(second)) for first, second in chosen]
        own = np.array([here for _, here, _ in fields])
        ratio = np.array([there / here for _, here, there in fields])
        fractions = [float((np.linalg.norm(f, axis=1) >= MOVED).mean()) for f, _, _ in fields]
        forces = np.array([felt(body, pair) for pair in chosen])
        rows.append({
            "body": candidate.label, "vertices": len(x), "size_m": size, "apart_deg": apart,
            "places": len(chosen), "slid": int(np.isnan(forces).sum()),
            "dent_m": float(np.median(own)), "dent_share": float(np.median(own)) / size,
            "other": float(np.median(ratio)), "other_least": float(np.abs(ratio).min()),
            "moved": float(np.median(fractions)),
            "felt_n": float(np.nanmedian(forces)), "felt_least_n": float(np.nanmin(np.abs(forces))),
            "felt_demo_n": felt_in(body, scene),
            "prepared_s": prepared, "starts_s": starts,
            "tick_s": tick(body, chosen[0], ticks) if apart == APART[1] else float("nan"),
        })  # fmt: skip
    return rows


HEAD = (
    "body | apart | places | dent at 2 N | of the size | other, C_ij/C_ii | least | moved | felt |"
    " least | at the demo's places | prepared | starts | tick"
)


def line(row: dict[str, float | str]) -> str:
    """One row as Markdown."""
    n = {name: float(value) for name, value in row.items() if name != "body"}
    parts = (
        row["body"], f"{n['apart_deg']:.0f} deg", f"{n['places']:.0f} of {FIRST}",
        f"{1e3 * n['dent_m']:.1f} mm", f"{100 * n['dent_share']:.1f} %",
        f"{n['other']:+.2f}", f"{n['other_least']:.2f}", f"{100 * n['moved']:.0f} %",
        f"{n['felt_n']:+.2f} N", f"{n['felt_least_n']:.2f} N", f"{n['felt_demo_n']:+.2f} N",
        f"{n['prepared_s']:.1f} s", f"{n['starts_s']:.1f} s",
        "" if math.isnan(n["tick_s"]) else f"{1e3 * n['tick_s']:.1f} ms",
    )  # fmt: skip
    return "| " + " | ".join(map(str, parts)) + " |"


def main() -> None:
    """Measure all and print the table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--ticks", type=int, default=200, help="of each body")
    options: argparse.Namespace = parser.parse_args()
    rows: list[dict[str, float | str]] = []
    print(f"| {HEAD} |\n|{'---|' * (HEAD.count('|') + 1)}")
    # A cache of its own, so that the first time is one.
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1):
        os.environ["COHAPTIC_CACHE"] = folder
        for candidate in CANDIDATES:
            for row in measure(candidate, options.ticks):
                print(line(row), flush=True)
                rows.append(row)
    json_report.write(options, rows)


if __name__ == "__main__":
    main()
