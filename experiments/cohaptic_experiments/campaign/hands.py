"""Thousands of rooms of one to eight hands: stability, force error, and time to the steady force.

Two questions. How do the laws compare on the ensemble of science 3.4, each with and without the
passivity layer, beside the paper's own rule K_h < 1 / C_ii, which considers one contact only? And
where are the limits of the predictive law with the room's lag: the rows of `rows.py`, science 3.11.
Each trial runs the client's and the server's own functions (`kernel.py`) and is identified by seed
and index: `--trial` draws its forces. Unstable, slow and soft rooms are counted separately.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from cohaptic.control.law import Law
from cohaptic_experiments.campaign.rows import OURS, ROWS, SECONDS, WEAK_OFF, Row
from cohaptic_experiments.campaign.simulation import play, trace
from cohaptic_experiments.campaign.trials import MAX_USERS, Trial, draw, without_coupling
from cohaptic_experiments.campaign.variants import Variant
from cohaptic_experiments.campaign.verdicts import Verdicts
from cohaptic_experiments.machines import Over, machines
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
from cohaptic_experiments.plot_style import FOURTH, PROBE, PROXY, THIRD, canvas

NAME = "hands"
TITLE = "1 to 8 hands of every kind at any delay: stability, and force against the reference"
QUICK = 60  # trials of the short version
RULES = (
    Variant(Law.PROPORTIONAL, coupled=False),
    Variant(Law.PROPORTIONAL),
    Variant(Law.PI),
    OURS,
)
COLORS = dict(zip(RULES, (FOURTH, PROXY, THIRD, PROBE), strict=True))
# N in a haptic period, beyond the change that the hand's own motion and the damping explain: the
# safety layer's limit for changes by others, 20 N/s (`cohaptic_client.loop.safety`).
STEP = 0.02
ROUNDING = 1e-9  # N, of sums of doubles near the limit
FAR_OFF = 0.25  # relative error from which a trial is listed by index


def run(options: Options, progress: Progress) -> Outcome:
    """The campaign, or one of its trials."""
    if options.trial is not None:
        return _one(options.seed, options.trial)
    with machines(options.cluster) as over:
        return _all(options, progress, over)


def _all(options: Options, progress: Progress, over: Over) -> Outcome:
    count = QUICK if options.quick else options.trials
    trials = [draw(options.seed, i) for i in range(count)]
    rows = (*ROWS, WEAK_OFF)
    # Work in units of one trial of 8 s.
    done, work = (
        0.0,
        count * (2 * len(RULES) + 1 + sum(r.times * r.seconds / SECONDS for r in rows)),
    )

    def advance(more: float) -> None:
        nonlocal done
        done += more
        progress(min(1.0, done / work))

    judged: dict[Variant, Verdicts] = {}
    for rule in RULES:
        for variant in (rule.without_passivity, rule):
            judged[variant] = play(trials, variant, seconds=SECONDS, progress=advance, over=over)
    alone = [without_coupling(trial) for trial in trials]
    uncoupled = play(alone, OURS, seconds=SECONDS, progress=advance, over=over)
    played: dict[Row, Verdicts] = {}
    for row in rows:
        some = [row.draw(options.seed, i) for i in range(row.times * count)]
        longer = _longer(advance, row)
        played[row] = play(some, row.variant, seconds=row.seconds, progress=longer, over=over)
    return Outcome(
        _figure(judged),
        _table(options.seed, trials, judged),
        _numbers(options.seed, trials, judged, uncoupled) | _row_numbers(played),
        (*_checks(trials, judged, uncoupled), *_row_checks(played)),
    )


def _longer(advance: Callable[[float], None], row: Row) -> Callable[[int], None]:
    """Progress of a row in trials of the usual length."""
    return lambda more: advance(more * row.seconds / SECONDS)


def _row_checks(played: dict[Row, Verdicts]) -> tuple[Check, ...]:
    checks: list[Check] = []
    for row, verdicts in played.items():
        checks.append(at_most(f"{row.name}: unstable", int(verdicts.unstable.sum()), row.unstable))
        step = float(verdicts.step.max())
        checks.append(at_most(f"{row.name}: unexplained step, N", step, STEP + ROUNDING))
        if row.error is not None:
            error = _quantile(verdicts, 95)
            checks.append(at_most(f"{row.name}: 95th percentile of the error", error, row.error))
    return tuple(checks)


def _row_numbers(played: dict[Row, Verdicts]) -> dict[str, Number]:
    """Each row: rooms, unstable, slow and soft ones, errors, the largest step, lags."""
    numbers: dict[str, Number] = {}
    for row, v in played.items():
        numbers[f"row {row.name}"] = [
            len(v.unstable),
            int(v.unstable.sum()),
            int(v.slow.sum()),
            int(v.soft.sum()),
            _quantile(v, 50),
            _quantile(v, 95),
            float(v.step.max()),
            float(np.median(v.lag)),
            float(v.lag.max()),
        ]
        numbers[f"unstable trials of {row.name}"] = [float(i) for i in np.flatnonzero(v.unstable)]
    numbers["columns of rows"] = COLUMNS
    return numbers


COLUMNS = (
    "rooms, unstable, slow, soft, median error, 95th percentile, step [N], median lag [s], largest"
)


def _checks(
    trials: list[Trial], judged: dict[Variant, Verdicts], uncoupled: Verdicts
) -> tuple[Check, ...]:
    ours, paper = judged[OURS], judged[RULES[0].without_passivity]
    lone = np.array([len(trial.C) == 1 for trial in trials])
    return (
        at_most(f"{OURS.name}: unstable trials", int(ours.unstable.sum()), 0),
        at_most(f"{OURS.name}: median error of a force, share", _quantile(ours, 50), 0.01),
        at_most(f"{OURS.name}: 95th percentile of it", _quantile(ours, 95), 0.035),
        at_most("the same without coupling: largest error", float(uncoupled.errors.max()), 1e-3),
        # Above zero: where a contact ends, the force of its last period is still applied.
        at_most("passivity layer, one user: damping over force, largest",
                float(ours.damping[lone].max(initial=0.0)), 1e-3),
        at_most("passivity layer, median trial: damping over force, RMS",
                float(np.median(ours.damping)), 0.01),
        at_least("the paper's rule: share of unstable trials, above",
                 float(paper.unstable.mean()), 0.3),
    )  # fmt: skip


def _numbers(
    seed: int, trials: list[Trial], judged: dict[Variant, Verdicts], uncoupled: Verdicts
) -> dict[str, Number]:
    numbers: dict[str, Number] = {
        "trials": len(trials),
        "seconds_of_haptics_each": SECONDS,
        "largest_error_without_coupling": float(uncoupled.errors.max()),
    }
    for variant, verdicts in judged.items():
        name = variant.name
        numbers[f"{name}: unstable"] = int(verdicts.unstable.sum())
        numbers[f"{name}: median error"] = _quantile(verdicts, 50)
        numbers[f"{name}: 95th percentile error"] = _quantile(verdicts, 95)
        numbers[f"{name}: damping over force, median"] = float(np.median(verdicts.damping))
    ours = judged[OURS]
    short = np.flatnonzero(ours.unstable | (ours.error > FAR_OFF))
    numbers["trials_that_fell_short"] = [float(i) for i in short]
    numbers["to_see_one"] = f"cohaptic experiment {NAME} --out DIR --seed {seed} --trial INDEX"
    return numbers


def _quantile(verdicts: Verdicts, q: float) -> float:
    return float(np.percentile(verdicts.errors, q)) if verdicts.errors.size else float("nan")


def _table(seed: int, trials: list[Trial], judged: dict[Variant, Verdicts]) -> Table:
    """A row for each trial; for each variant whether it is unstable, and its largest error."""
    columns = ["seed", "trial", "object", "users", "longest round trip [s]"]
    for variant in judged:
        columns += [f"{variant.name}: unstable", f"{variant.name}: largest error"]
    rows: list[tuple[float | int | str | None, ...]] = []
    for i, trial in enumerate(trials):
        longest = float((trial.up + trial.down + 2.0 * trial.jitter).max())
        row: list[float | int | str | None] = [seed, i, trial.object, len(trial.C), longest]
        for verdicts in judged.values():
            row += [int(verdicts.unstable[i]), float(verdicts.error[i])]
        rows.append(tuple(row))
    return Table(tuple(columns), rows)


def _figure(judged: dict[Variant, Verdicts]) -> Figure:
    """Unstable shares; error of every force; the same over the size of the room."""
    figure = canvas(8.2, 3.0)
    bars, spread, rooms = figure.subplots(1, 3, width_ratios=(1.1, 1.2, 1.0))
    for place, rule in enumerate(RULES):
        for shift, variant in ((-0.2, rule.without_passivity), (0.2, rule)):
            fraction = 100.0 * float(judged[variant].unstable.mean())
            bars.barh(
                place + shift,
                fraction,
                0.36,
                color=COLORS[rule],
                alpha=0.4 if variant.budget == 0.0 else 1.0,
            )
            bars.annotate(
                f"{fraction:.3g} %", (fraction, place + shift), xytext=(3, 0),
                textcoords="offset points", va="center", fontsize=7,
            )  # fmt: skip
        errors = np.sort(judged[rule].errors)
        fractions = 100.0 * np.arange(1, errors.size + 1) / errors.size
        spread.plot(
            100.0 * np.maximum(errors, 1e-5), fractions, color=COLORS[rule], label=rule.rule
        )
        verdicts = judged[rule]
        sizes = [n for n in range(1, MAX_USERS + 1) if (verdicts.users == n).any()]
        worst = [100.0 * np.percentile(verdicts.errors[verdicts.users == n], 95) for n in sizes]
        rooms.plot(sizes, worst, color=COLORS[rule], marker="o", markersize=3)
    bars.set_yticks(range(len(RULES)), [rule.rule for rule in RULES])
    bars.set_xlim(0.0, 100.0)
    bars.set_title("unstable trials [%]\npale: without the passivity layer")
    spread.set_xscale("log")
    spread.axvline(1.0, color="black", linewidth=0.7, linestyle=":")
    spread.axvline(25.0, color="black", linewidth=0.7, linestyle=":")
    spread.set_title("forces within an error [%]\nof all in stable trials")
    spread.set_xlabel("error of the steady force [%]")
    spread.set_ylim(0.0, 101.0)
    rooms.set_title("95th percentile of the error [%]\nover the size of the room")
    rooms.set_xlabel("users")
    rooms.set_ylim(0.0, 105.0)
    figure.legend(*spread.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _one(seed: int, index: int) -> Outcome:
    """Forces over time of one trial, under each rule with the passivity layer."""
    trial = draw(seed, index)
    figure = canvas(8.2, 4.6)
    axes = figure.subplots(2, 2, sharex=True)
    rows: list[tuple[float | int | str | None, ...]] = []
    checks: list[Check] = []
    for place, rule in zip(axes.flat, RULES, strict=True):
        t, forces = trace(trial, rule, seconds=SECONDS)
        place.plot(t, forces, linewidth=0.9)
        for force in trial.reference:
            place.axhline(float(force), color="black", linewidth=0.5, linestyle=":")
        place.set_title(rule.name)
        place.set_ylim(0.0, 2.0 * float(trial.reference.max()))
        verdict = play([trial], rule, seconds=SECONDS)
        rows.append((rule.name, int(verdict.unstable[0]), float(verdict.error[0])))
        if rule is OURS:
            checks += [
                at_most(f"{rule.name}: unstable", int(verdict.unstable[0]), 0),
                at_most(f"{rule.name}: largest error, share", float(verdict.error[0]), FAR_OFF),
            ]
    figure.supxlabel("time [s]", fontsize=9)
    figure.supylabel("force on each hand [N]; dotted: the reference", fontsize=9)
    numbers: dict[str, Number] = {
        "trial": index,
        "object": trial.object,
        "users": len(trial.C),
        "simulation_hz": 1.0 / trial.simulation_period,
        "round_trip_ms": [float(1e3 * x) for x in trial.up + trial.down],
        "k_o": [float(1.0 / c) for c in np.diag(trial.C)],
        "reference_n": [float(f) for f in trial.reference],
    }
    return Outcome(
        figure, Table(("rule", "unstable", "largest error"), rows), numbers, tuple(checks)
    )
