"""One to sixteen users in a ring round the balloon: what room they leave each other.

The row rules (`gains.choose_gains`) hold every K_h down for the neighbours' sake, and with it the
stiffness that K_h alone gives a hand: K_h with the predictive law, K_h and K_o in a row with the
others, eq. (11). That is final for P; the integrals of PI and of the predictive law bring the rest
back, the slower the tighter the cap. Sessions at 80 ms each way measure what is reached against the
equilibrium of body and hands (`equilibrium.solve`).
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Law
from cohaptic.control.stability import spectral_radius
from cohaptic_client.devices.simulated import SimulatedDevice
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
from cohaptic_experiments.plot_style import PROBE, PROXY, THIRD, canvas
from cohaptic_experiments.ring import DELAY, Played, play, ring_compliance
from cohaptic_server.bodies.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.mesh import Floats

NAME = "crowd"
TITLE = "1 to 16 users: stiffness, margin, and steady forces against the truth"
LAWS = {Law.PREDICTIVE: PROBE, Law.PI: THIRD, Law.PROPORTIONAL: PROXY}
# Seconds of a session; the integral of the predictive law restores the more slowly the more users.
SECONDS = {Law.PROPORTIONAL: (5, 5, 5, 5), Law.PI: (10, 10, 10, 10), Law.PREDICTIVE: (6, 6, 9, 13)}
CROWDS = (2, 4, 8, 16)


@dataclass(frozen=True, slots=True)
class Chosen:
    """What the row rules choose for a crowd.

    Args:
        law: Of everybody.
        users: How many.
        fast: Stiffness that K_h alone gives a hand over K_o, least of all users.
        rho: Spectral radius under any delay, of the fast gains; stable iff < 1.
    """

    law: Law
    users: int
    fast: float
    rho: float


def run(options: Options, progress: Progress) -> Outcome:
    """Choose gains for every crowd, then play a few."""
    body = Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03) if options.quick else None)
    numbers = (1, 2, 4, 8) if options.quick else range(1, 17)
    chosen = [_choose(law, ring_compliance(body, n)) for law in LAWS for n in numbers]
    progress(0.05)
    crowds = CROWDS[:2] if options.quick else CROWDS
    work = {(law, n): n * SECONDS[law][CROWDS.index(n)] for law in LAWS for n in crowds}
    played: list[Played] = []
    done = 0
    for (law, n), part in work.items():
        played.append(play(body, law, n, part / n, options.seed))
        done += part
        progress(0.05 + 0.95 * done / sum(work.values()))
    fast = {(c.law, c.users): c.fast for c in chosen}
    gain = min(fast[Law.PREDICTIVE, n] / fast[Law.PROPORTIONAL, n] for n in numbers)
    two = fast[Law.PREDICTIVE, 2]
    exact = [p.error for p in played if p.law is Law.PREDICTIVE]
    checks: tuple[Check, ...] = (
        at_most("rho under any delay, largest of all", max(c.rho for c in chosen), ALPHA + 1e-6),
        at_least("predictive, two users: stiffness of K_h over K_o", two, 0.999),
        at_least("predictive: stiffness of K_h over the proportional law's, least", gain, 1.0),
        at_most("predictive: largest error of a steady force, share", max(exact), 0.02),
        at_most("largest swing in the last second, share of the force",
                max(p.swing for p in played), 0.01),
    )  # fmt: skip
    values: dict[str, Number] = {"users": [float(n) for n in numbers]}
    for law in LAWS:
        values[f"{law.value}_felt_of_k_h_over_k_o"] = [c.fast for c in chosen if c.law is law]
        values[f"{law.value}_rho"] = [c.rho for c in chosen if c.law is law]
        values[f"{law.value}_error_of_sessions"] = [p.error for p in played if p.law is law]
    values["users_of_sessions"] = [float(n) for n in crowds]
    return Outcome(_figure(chosen, played), _table(chosen, played), values, checks)


def _choose(law: Law, C: Floats) -> Chosen:
    """Gains of the row rules, and what they are worth."""
    n = len(C)
    k_h = np.array(
        [
            choose_gains(
                law,
                row,
                i,
                max_stiffness=SimulatedDevice.info.max_stiffness,
                loop_delay=2.0 * DELAY,
                simulation_period=1.0 / 60.0,
            ).k_h
            for i, row in enumerate(C.tolist())
        ]
    )
    c = np.diag(C)
    # The predictive law shows its own dent at once; the others are in a row with the body.
    share = k_h * c if law is Law.PREDICTIVE else k_h * c / (1.0 + k_h * c)
    M = C - np.diag(c) if law is Law.PREDICTIVE else C
    return Chosen(law, n, float(share.min()), spectral_radius(k_h[:, None] * np.abs(M)))


def _figure(chosen: list[Chosen], played: list[Played]) -> Figure:
    """Stiffness, margin and steady error over the number of users."""
    figure = canvas(6.8, 2.9)
    left, middle, right = figure.subplots(1, 3)
    for law, color in LAWS.items():
        some = [c for c in chosen if c.law is law]
        n = [c.users for c in some]
        style = {"color": color, "marker": "o", "markersize": 3.5}
        left.plot(n, [c.fast for c in some], label=law.value, **style)
        middle.plot(n, [c.rho for c in some], **style)
        sessions = [p for p in played if p.law is law]
        right.plot([p.users for p in sessions], [100.0 * p.error for p in sessions], **style)
    middle.axhline(1.0, color="black", linewidth=0.8, linestyle="--")
    left.set_title("felt stiffness of $K_h$ / $K_o$")
    middle.set_title(r"$\rho$ under any delay; stable < 1")
    right.set_title("steady force error, 80 ms [%]")
    left.set_ylim(0.0, 1.05)
    middle.set_ylim(0.0, 1.05)
    right.set_ylim(-2.0, 100.0)
    for axes in (left, middle, right):
        axes.set_xlabel("users")
        axes.set_xticks([1, 4, 8, 12, 16])
    figure.legend(loc="outside lower center", ncols=len(LAWS))
    return figure


def _table(chosen: list[Chosen], played: list[Played]) -> Table:
    """A row for each law and crowd; sessions where there are some."""
    sessions = {(p.law, p.users): p for p in played}
    rows: list[tuple[float | int | str | None, ...]] = []
    for c in chosen:
        p = sessions.get((c.law, c.users))
        measured = (p.error, p.swing, p.seconds) if p else (None, None, None)
        rows.append((c.law.value, c.users, c.fast, c.rho, *measured))
    names = ("law", "users", "felt of K_h / K_o", "rho", "steady error", "swing / force", "seconds")
    return Table(names, rows)
