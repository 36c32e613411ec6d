"""Sessions of two hands on an object from a file, in virtual time, against the equilibrium.

The hands stand where the demo puts them or on the softest part (`limb_places.py`), as in the demo's
rhythm: `left` stays off, then presses, while `right` rests in the object. Forces are compared where
the demo compares them; then `left` presses on, since a room may swing that seemed to rest. Room,
world, frames, links and loops are the product's; the columns of a solid are exact at once, as if a
process beside the tick had delivered them. `object_session.py` is the command.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from threadpoolctl import threadpool_limits

from cohaptic.control.law import Law
from cohaptic.errors import BodyError
from cohaptic.protocol.patch import MIN_COMPLIANCE
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_client.devices.simulated import INFO
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession
from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.cli.object_options import ObjectOptions, takes_object
from cohaptic_server.cli.resolved_object import resolved
from cohaptic_server.mesh.surface import pressure, spread_over
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.objects.cost import Demand
from cohaptic_tools.demo.analysis import measured
from cohaptic_tools.demo.lateness import LEAST
from cohaptic_tools.demo.rest import Rest, judge, reaches_limit
from cohaptic_tools.demo.scene import Scene, reference
from cohaptic_tools.demo.set_up import describe_placement, set_up
from limb_places import place_on_limb

DELAYS = (0.0, 0.08, 0.25)  # s, one way
SURVEYED = 40  # vertices, spread over the surface, whose compliance is compared
# s, and ways round, for which `left` presses on. A room on a lobe of rubber was at rest for the
# demo's five ways round and went up by a third of its force once a second after that.
HELD_ON, HELD_ON_TRIPS = 4.0, 10.0
_WORST_FIRST = (Rest.UNSTABLE, Rest.SLOW, Rest.RESTS)

Row = dict[str, Any]


def _quiet(phase: str, fraction: float) -> None:
    """The progress of a preparation, which nobody watches."""


def play(body: Body, scene: Scene, trips: float = HELD_ON_TRIPS) -> Row:
    """One session with the delay of the scene, measured with `left` off and pressed.

    Args:
        body: That is touched.
        scene: Two hands and their delay.
        trips: Ways round for which `left` presses on, besides `HELD_ON`.

    Returns:
        `press_n`, the force of `left` in the reference, and `felt_n`, the part of the force on
        `right` that is due to it;
        `force_error` and `felt_error`, the worst of both hands and levels, over the reference or
        over `LEAST` [N] if that is larger; `rest`; `late_error`, the worst of a force over all of
        the second half of the time for which `left` presses on, in the same share; `force_n`, the
        largest reference;
        `unexplained_n_per_ms`, the largest change of a force that its own hand did not make.

    Raises:
        BodyError: The reference does not converge.
    """
    session = VirtualSession(body, scene.simulation_hz)
    # Engaged, and with patches, before it approaches.
    begin = 1.0 + 2.0 * scene.link.delay
    for k, name in enumerate(scene.names):
        at = begin + (0.5 * scene.rhythm.period if k == 0 else 0.0)
        script = replace(scene.script(k), approach_at=at, rhythm=None)
        session.join(name, script, delay=scene.link.delay, seed=k, geometry="mesh", law=scene.law)
    period, ramp = scene.rhythm.period, 0.5  # s; the approach
    session.run(begin + period)
    stretches = [
        slice(round((begin + at + ramp) / PERIOD), round((begin + at + 0.5 * period) / PERIOD) - 10)
        for at in (0.0, 0.5 * period)
    ]
    force = np.array([user.force for user in session.users.values()])
    felt = np.array([user.felt for user in session.users.values()])
    expected = [reference(scene, body, pressed=pressed) for pressed in (False, True)]
    verdicts = [
        Rest.UNSTABLE if reaches_limit(row, stretches, INFO.max_force, always=True) else verdict
        for row, verdict in zip(force, judge(force, stretches, stretches, measured), strict=True)
    ]
    ends = [measured(stretch) for stretch in stretches]
    on = HELD_ON + trips * 2.0 * scene.link.delay
    session.run(on)
    late = np.array([user.force for user in session.users.values()])[:, -round(0.5 * on / PERIOD) :]
    pressed = expected[1].force[:, None]
    return {
        "delay_s": scene.link.delay,
        "press_n": float(expected[1].force[0]),
        "felt_n": float(abs(expected[1].felt_from_others[1])),
        "force_error": _worst_error(force, ends, [e.force for e in expected]),
        "felt_error": _worst_error(felt, ends, [e.felt_from_others for e in expected]),
        "late_error": float((np.abs(late - pressed) / np.maximum(pressed, LEAST)).max()),
        "rest": next(rest.value for rest in _WORST_FIRST if rest in verdicts),
        "force_n": float(max(e.force.max() for e in expected)),
        "unexplained_n_per_ms": max(max(user.unexplained) for user in session.users.values()),
    }


def _worst_error(values: Floats, ends: list[slice], expected: list[Floats]) -> float:
    """Largest error of mean values at the ends of stretches; values of shape (users, n) [N]."""
    errors = [
        np.abs(values[:, end].mean(axis=1) - e) / np.maximum(np.abs(e), LEAST)
        for end, e in zip(ends, expected, strict=True)
    ]
    return float(np.max(errors))


def survey(body: Body, held: Mask) -> Row:
    """How well the table of compliances agrees with presses at some of the vertices.

    Args:
        body: The body at rest.
        held: Vertices of its surface that do not move, which are left out, shape (n,).

    Returns:
        `share_within_5_percent` and `worst_error`; nothing if all that were tried are held.
    """
    table, mesh = vertex_compliance(body), body.mesh
    errors: list[float] = []
    for k in spread_over(mesh.vertices, SURVEYED).tolist():
        x, n = mesh.vertices[k], mesh.normals[k]
        load = Load(*pressure(mesh, x, body.contact_radius, n), -n, 0.0)
        exact = float(body.respond([load]).compliance[0, 0])
        if exact > MIN_COMPLIANCE and not held[k]:
            errors.append(abs(float(table[k]) / exact - 1.0))
    if not errors:
        return {}
    return {
        "share_within_5_percent": float(np.mean(np.array(errors) <= 0.05)),
        "worst_error": max(errors),
    }


@takes_object
def main(
    file: Path,
    *,
    options: ObjectOptions,
    nonlinear: Annotated[bool, typer.Option("--nonlinear")] = False,
    limb: Annotated[bool, typer.Option("--limb")] = False,
    law: Annotated[Law, typer.Option()] = Law.PREDICTIVE,
    delays_ms: Annotated[list[float] | None, typer.Option()] = None,
    hold_trips: Annotated[float, typer.Option(min=0.0)] = HELD_ON_TRIPS,
) -> None:
    """Play a session for each delay; the last line is what was measured, as JSON in SI units."""
    row: Row = {"sessions": []}
    delays = DELAYS if not delays_ms else [1e-3 * delay for delay in delays_ms]
    with threadpool_limits(limits=1):  # as in the server's tick
        try:
            scene = Scene(link=LinkSettings(delays[0]), law=law)
            demand = Demand(scene.users, scene.simulation_hz, nonlinear)
            source = resolved(file, options, _quiet, print, demand)
            body, scene, row["places"] = set_up(
                scene, str(file), source, nonlinear=nonlinear, progress=_quiet
            )
            assert isinstance(body, Solid | RubberSolid)  # all that is made of a file
            row["tetrahedra"] = len(body.shape.tets.tets)
            if limb:
                found = place_on_limb(body, body.shape.held)
                placed = found.placement
                scene = replace(scene, places=placed.places, depth=placed.depth)
                row["places"] = describe_placement(placed, scene.names)
                row["passed_over"] = found.passed_over
            row["surface_vertices"] = len(body.mesh.vertices)
            for delay in delays:
                row["sessions"].append(
                    play(body, replace(scene, link=LinkSettings(delay)), hold_trips)
                )
            if isinstance(body, Solid):
                row |= survey(body, body.shape.held)
        except BodyError as error:
            row["error"] = str(error)
    print(json.dumps(row, allow_nan=False))  # a figure that is none is an error
