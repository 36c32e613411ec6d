"""Two to sixteen users in a ring round the balloon who press at once: forces and settling times.

The predictive law gives every hand the object's own stiffness for any number of users; the forces
of the others pass the room's lag, which grows with their number (science 3.8). So every steady
force equals the reference, and many users cost time. P needs a low K_h because of the neighbours
and stays far from the reference; the integral of PI comes near it, late. Sessions at 80 ms each way
are compared with the equilibrium of body and hands (`equilibrium.solve`).
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

import math

from matplotlib.figure import Figure

from cohaptic.control.law import Law
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_experiments.outcome import (
    Check,
    Number,
    Options,
    Outcome,
    Progress,
    Table,
    at_least,
    at_most,
)
from cohaptic_experiments.plot_style import GREY, PROBE, PROXY, THIRD, canvas
from cohaptic_experiments.users.ring import REACHED, Played, play
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings

NAME = "crowd"  # of the command, `cohaptic experiment crowd`
TITLE = "2 to 16 users: steady forces against the reference, and the time that they take"
LAWS = {Law.PREDICTIVE: PROBE, Law.PI: THIRD, Law.PROPORTIONAL: PROXY}
# Users of each session, and how long it takes [s]: a larger room needs longer.
SESSIONS = {
    Law.PREDICTIVE: {2: 4, 4: 5, 6: 6, 8: 6, 12: 8, 16: 9},
    Law.PI: {2: 10, 4: 10, 8: 10, 16: 10},
    Law.PROPORTIONAL: {2: 5, 4: 5, 8: 5, 16: 5},
}
QUICK = {
    Law.PREDICTIVE: {2: 4, 6: 6},
    Law.PI: {2: 6},
    Law.PROPORTIONAL: {2: 5},
}
MANY = (6, 8)  # numbers of users for which `PATIENCE` is checked
PATIENCE = 3.0  # s until every force is within `REACHED` of the reference
# N in a period: the limit of the safety layer for changes by others, and the rounding of the wire.
STEP = EXTERNAL_RATE * PERIOD + 1e-6


def run(options: Options, progress: Progress) -> Outcome:
    """Play every room."""
    body = Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03) if options.quick else None)
    sessions = QUICK if options.quick else SESSIONS
    rooms = [(law, n, s) for law, durations in sessions.items() for n, s in durations.items()]
    work, done = sum(n * seconds for _, n, seconds in rooms), 0
    played: list[Played] = []
    for law, n, seconds in rooms:
        played.append(play(body, law, n, float(seconds), options.seed))
        done += n * seconds
        progress(done / work)
    values: dict[str, Number] = {}
    for law in LAWS:
        mine = [p for p in played if p.law is law]
        values[f"{law.value}_users"] = [float(p.users) for p in mine]
        values[f"{law.value}_error"] = [p.error for p in mine]
        values[f"{law.value}_reached_s"] = [p.reached for p in mine]
        values[f"{law.value}_lag_s"] = [p.lag for p in mine]
    return Outcome(_figure(played), _table(played), values, _checks(played))


def _checks(played: list[Played]) -> tuple[Check, ...]:
    exact = [p for p in played if p.law is Law.PREDICTIVE]
    softest = [p.error for p in played if p.law is Law.PROPORTIONAL]
    fraction = f"{100.0 * REACHED:g} %"
    reached = [
        at_most(
            f"predictive, {p.users} users: every force within {fraction} of the reference after, s",
            p.reached,
            PATIENCE,
        )
        for p in exact
        if p.users in MANY
    ]
    return (
        *reached,
        at_most("predictive: largest error of a steady force, share", max(p.error for p in exact),
                REACHED),
        at_most("largest swing in the last second, share of the force",
                max(p.swing for p in played), 0.01),
        at_most("largest step of a force that its hand's motion does not explain, N in a period",
                max(p.step for p in played), STEP),
        at_least("proportional: error of a steady force, share, least of all rooms", min(softest),
                 0.3),
    )  # fmt: skip


def _figure(played: list[Played]) -> Figure:
    """Time and steady error over the number of users; approach to the reference."""
    figure = canvas(6.8, 2.9)
    left, middle, right = figure.subplots(1, 3)
    for law, color in LAWS.items():
        some = [p for p in played if p.law is law]
        n = [p.users for p in some]
        style = {"color": color, "marker": "o", "markersize": 3.5}
        # A room that never comes so near has no point.
        left.plot(n, [p.reached for p in some], label=law.value, **style)
        middle.plot(n, [100.0 * p.error for p in some], **style)
    exact = [p for p in played if p.law is Law.PREDICTIVE]
    for p in exact:
        right.plot(p.t, 100.0 * p.furthest, color=PROBE, linewidth=0.9)
    # The rooms lie close together: only the quickest and the slowest one have room for a name.
    come = sorted((p for p in exact if math.isfinite(p.reached)), key=lambda p: p.reached)
    for p, side in zip(come[:: max(1, len(come) - 1)], ("right", "left"), strict=False):
        place = (p.reached, 100.0 * REACHED)
        right.annotate(f"  {p.users} users  ", place, fontsize=6, va="bottom", ha=side)
    left.axhline(PATIENCE, color=GREY, linewidth=0.8, linestyle="--")
    right.axhline(100.0 * REACHED, color=GREY, linewidth=0.8, linestyle="--")
    left.set_title("until within 1 %\nof the reference [s]")
    middle.set_title("steady force\nerror [%]")
    right.set_title("predictive:\nfurthest force [%]")
    left.set_ylim(bottom=0.0)
    middle.set_ylim(-2.0, 100.0)
    right.set_yscale("log")
    right.set_ylim(0.05, 120.0)
    right.set_xlim(0.0, PATIENCE)
    for axes in (left, middle):
        axes.set_xlabel("users, 80 ms each way")
        axes.set_xticks([2, 4, 8, 12, 16])
    right.set_xlabel("time since they press [s]")
    figure.legend(loc="outside lower center", ncols=len(LAWS))
    return figure


def _table(played: list[Played]) -> Table:
    """A row for each room."""
    names = ("law", "users", "seconds", "reached [s]", "steady error", "swing / force", "step [N]",
             "lag [s]", "m")  # fmt: skip
    return Table(
        names,
        [
            (p.law.value, p.users, p.seconds, p.reached, p.error, p.swing, p.step, p.lag,
             p.coupling)
            for p in played
        ],
    )  # fmt: skip
