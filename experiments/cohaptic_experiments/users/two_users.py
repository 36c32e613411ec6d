"""Extension 2: two users on one balloon feel each other.

Right holds still and presses; left presses and lets go on the other side. Gains, smoothing and
passivity layer as in the product, 80 ms each way. The reference is the equilibrium of body and
hands (`equilibrium.solve`). The predictive law must reach it; the proportional one reaches another
equilibrium, with its own local model in a row with the body, and must reach that.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from cohaptic.control.law import Law
from cohaptic.simulated.hand import HandScript, Intention, Rhythm
from cohaptic_experiments.outcome import (
    Check,
    Options,
    Outcome,
    Progress,
    Table,
    at_least,
    at_most,
    part,
)
from cohaptic_experiments.paper.recording import Trace, record
from cohaptic_experiments.plot_style import GREY, PROBE, PROXY, canvas
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import Equilibrium, RestingHand, complementarity, solve

NAME = "ext2"
TITLE = "two users feel each other: forces and reference, predictive and proportional"
DELAY = 0.08  # s, one way
RHYTHM = Rhythm(6.0)
SCRIPTS = {
    "left": HandScript(math.pi, depth=0.02, rhythm=RHYTHM),
    "right": HandScript(0.0, depth=0.012),
}
LAWS = (Law.PREDICTIVE, Law.PROPORTIONAL)
TOLERANCE = 0.02


@dataclass(frozen=True, eq=False)
class Played:
    """A session with one law.

    Args:
        traces: By name.
        steady: Forces of left and right at the end of left's pause and of its press, (2, 2) [N].
        felt: Part of right's force that left causes, at the same times, shape (2,) [N].
        k_h: Gains at the end, shape (2,) [N/m].
    """

    traces: Mapping[str, Trace]
    steady: Floats
    felt: Floats
    k_h: Floats


def run(options: Options, progress: Progress) -> Outcome:
    """Both laws, and the reference with left away and with left pressing."""
    mesh = BalloonSettings(subdivisions=2, contact_radius=0.03)
    body = Balloon(mesh if options.quick else None)
    info = describe(body)
    presses = {name: s.intention(info.center, info.radius) for name, s in SCRIPTS.items()}
    references = [_reference(body, presses, level) for level in (0.0, 1.0)]
    played: dict[Law, Played] = {}
    for i, law in enumerate(LAWS):
        fraction = 1.0 / len(LAWS)
        played[law] = _play(body, presses, law, options, part(progress, i * fraction, fraction))
    forces = np.array([r.force for r in references])  # (2 levels, 2 users)
    felt = np.array([r.felt_from_others[1] for r in references])
    p = played[Law.PROPORTIONAL]
    # Local model, hand and body are springs in series.
    series = [_with_model(r, presses, p.k_h, level) for level, r in enumerate(references)]
    checks: list[Check] = []
    largest = float(forces.max())
    for law, expected, against in (
        (Law.PREDICTIVE, forces, "equilibrium of body and hands"),
        (Law.PROPORTIONAL, np.array(series), "equilibrium with local models in a row"),
    ):
        error = float(np.abs(played[law].steady - expected).max()) / largest
        sentence = f"{law.value}: steady forces off the {against}, share of the largest"
        checks.append(at_most(sentence, error, TOLERANCE))
    part_felt = {law: float(played[law].felt[1] / felt[1]) for law in LAWS}
    checks.append(at_least("true part of right's force that is left's doing, N", felt[1], 0.1))
    off = abs(part_felt[Law.PREDICTIVE] - 1.0)
    checks.append(at_most("predictive: part felt from the other off the reference", off, TOLERANCE))
    numbers = {
        "true_force_right_alone_n": float(forces[0, 1]),
        "true_force_right_n": float(forces[1, 1]),
        "true_felt_by_right_n": float(felt[1]),
        **{f"{law.value}_force_right_n": float(played[law].steady[1, 1]) for law in LAWS},
        **{f"{law.value}_felt_by_right_n": float(played[law].felt[1]) for law in LAWS},
        **{f"{law.value}_share_of_reference_felt": part_felt[law] for law in LAWS},
    }
    return Outcome(_figure(played, forces, felt), _table(played), numbers, tuple(checks))


def _play(
    body: Body,
    presses: Mapping[str, Intention],
    law: Law,
    options: Options,
    progress: Progress,
) -> Played:
    """One session; steady values are means over the last 50 ms of a pause and of a press."""
    session = VirtualSession(body)
    for i, (name, script) in enumerate(SCRIPTS.items()):
        seed = 2 * options.seed + i
        session.join(name, script, law=law, delay=DELAY, jitter=0.1 * DELAY, seed=seed)
    cycles = 1 if options.quick else 2
    begin = SCRIPTS["left"].approach_at
    traces = record(session, presses, begin + cycles * RHYTHM.period, progress)
    ends = begin + (cycles - 1) * RHYTHM.period + np.array([0.5, 1.0]) * RHYTHM.period
    near = [slice(round(1e3 * t) - 60, round(1e3 * t) - 10) for t in ends]
    steady = np.array([[traces[n].force[at].mean() for n in SCRIPTS] for at in near])
    felt = np.array([traces["right"].felt[at].mean() for at in near])
    k_h = np.array([session.users[n].state.k_h for n in SCRIPTS])
    return Played(traces, steady, felt, k_h)


def _reference(body: Body, presses: Mapping[str, Intention], level: float) -> Equilibrium:
    """Body and hands in equilibrium with left at a level and right pressing."""
    hands = (
        RestingHand(presses["left"].tip(level), SCRIPTS["left"].hand.stiffness),
        RestingHand(presses["right"].tip(1.0), SCRIPTS["right"].hand.stiffness),
    )
    return solve(body, hands)


def _with_model(
    reference: Equilibrium, presses: Mapping[str, Intention], k_h: Floats, level: float
) -> Floats:
    """Forces with the local models in series: eq. (11) for two users, shape (2,) [N]."""
    hands = 1.0 / np.array([script.hand.stiffness for script in SCRIPTS.values()]) + 1.0 / k_h
    left, right = presses["left"], presses["right"]
    depth = np.array([-left.clearance + (left.clearance + left.depth) * level, right.depth])
    return complementarity(reference.compliance + np.diag(hands), depth)


def _figure(played: Mapping[Law, Played], reference: Floats, felt: Floats) -> Figure:
    """For each law the forces on both hands, and right's part caused by left; reference dashed."""
    figure = canvas(6.8, 4.2)
    axes = figure.subplots(2, len(LAWS), sharex=True, sharey="row")
    for j, law in enumerate(LAWS):
        top, bottom = axes[0, j], axes[1, j]
        left, right = (played[law].traces[name] for name in SCRIPTS)
        (a,) = top.plot(left.t, left.force, color=PROXY, label="left presses and lets go")
        (b,) = top.plot(right.t, right.force, color=PROBE, label="right rests")
        expected = ((reference[1, 0], PROXY), (reference[1, 1], PROBE), (reference[0, 1], PROBE))
        for value, color in expected:
            top.axhline(value, color=color, linewidth=0.8, linestyle="--")
        bottom.plot(right.t, right.felt, color=PROBE)
        bottom.axhline(felt[1], color=PROBE, linewidth=0.8, linestyle="--")
        (c,) = bottom.plot([], [], color=GREY, linewidth=0.8, linestyle="--", label="reference")
        top.set_title(f"{law.value}, {1e3 * DELAY:.0f} ms each way")
        bottom.set_xlabel("time [s]")
        if j == 0:
            top.set_ylabel("force on the hand [N]")
            bottom.set_ylabel("right feels of left [N]")
            figure.legend(handles=[a, b, c], loc="outside lower center", ncols=3)
    return figure


def _table(played: Mapping[Law, Played]) -> Table:
    """Forces of both, every 5 ms."""
    names, columns = ["t [s]"], [played[LAWS[0]].traces["left"].t]
    for law in LAWS:
        left, right = (played[law].traces[name] for name in SCRIPTS)
        names += [f"{law.value}: {name} [N]" for name in ("left", "right", "right feels of left")]
        columns += [left.force, right.force, right.felt]
    return Table(tuple(names), list(zip(*(c[::5].tolist() for c in columns), strict=True)))
