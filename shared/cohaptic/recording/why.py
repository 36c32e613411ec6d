"""Why a force was as it was: the ledger of a recorded period, in newtons and words.

Each row of a recording has what each rule of the loop did to the force in that period
(`cohaptic.status.row`). Functions of arrays; the command is `cohaptic why`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from cohaptic.errors import SettingError
from cohaptic.status.reason import FLAGS, RELEASED, SILENT, WAITING, cause_in, flags_in
from cohaptic.status.row import COLUMNS

Floats = npt.NDArray[np.float64]
Columns = Mapping[str, Floats]

# Entries of a ledger in the order of the rules, with what they are. They add up to the force.
ENTRIES: Final = {
    "by_surface": "the law's spring on the surface of the newest patches",
    "by_models": "models of the other hands, which answer at once",
    "by_gain": "the gain follows the object's stiffness slowly",
    "by_depth": "the surface moves faster than the budget lets it move the force",
    "by_law": "the law beyond its spring: integral, own dent, or the law before it",
    "damping": "damping of energy that the network has made",
    "by_friction": "friction",
    "by_limit": "the largest force of this hand",
    "by_fade": "a fade",
    "by_rate": "the force changes no faster than its limit",
}
SPENT: Final = {
    "spent_gain": "gain",
    "spent_fades": "reserve",
    "spent_turn": "turn",
    "spent_models": "models",
    "spent_depth": "depth",
}
# What the server's tick made of the force that it had heard of.
TICK: Final = {
    "tick_presence": "this user comes, leaves, is silent, has jumped or is out of reach",
    "tick_limit": "the largest force of contact and object",
    "tick_anticipation": "answers of the other hands that are still on their way",
    "tick_lag": "the room's lag",
    "tick_rate": "others' forces may not change so fast",
}
# The same while a force is taken away.
_TAKEN_AWAY: Final = {
    "by_fade": "the force is taken away",
    "by_rate": "what is left of it, on a ramp of 20 ms",
}
_SEEN: Final = 0.01  # N; a smaller entry is not worth a word
_SOFTER: Final = 1.0  # N/m; a gain that is less by no more is not worth a word
_LATE: Final = 0.003  # s; a period that begins later was held up by the machine, or by a rule
_TAKEN: Final = 0.0002  # N of a budget of 0.02; a smaller part is not worth a word
_SUM: Final = 0.005  # N; entries that miss the force by more are not all of it
_OLD: Final = 0.1  # s; age of a patch that is said although no rule has acted on it


@dataclass(frozen=True)
class Entry:
    """One line of the table.

    Args:
        name: Name of the rule.
        newtons: What it did [N].
        words: What it is.
    """

    name: str
    newtons: float
    words: str


@dataclass(frozen=True)
class Why:
    """The ledger of one period.

    Args:
        t: Time since the beginning of the recording [s].
        force: Size of the force on the hand [N].
        entries: What rules did; together they are the force.
        server: What the server's tick added to the force that it had heard of, at the tick of the
            newest patch.
        spent: Who took how much of the budget [N].
        budget: The budget [N].
        reasons: What else held, in words.
        sentence: All of it in one sentence.
    """

    t: float
    force: float
    entries: tuple[Entry, ...]
    server: tuple[Entry, ...]
    spent: dict[str, float]
    budget: float
    reasons: tuple[str, ...]
    sentence: str


def check_ledger(path: Path, columns: Columns) -> None:
    """Check that a recording has a ledger.

    Raises:
        SettingError: It is of an earlier version, or empty.
    """
    if not columns["t"].size:
        raise SettingError("recording", path, "one with rows: there is not one in it")
    needed = [name for name in COLUMNS if not name.startswith("by_rule_")]
    if missing := [name for name in needed if name not in columns]:
        limit = f"a recording with a ledger, of version 0.1 or later ({missing[0]} is missing)"
        raise SettingError("recording", path, limit)


def entries_in(columns: Columns, rules: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the entries of a ledger with those of other packages, by column, in order.

    Args:
        columns: Columns of a recording.
        rules: Rules of other packages, and the reason of each.
    """
    known, found = rules or {}, dict[str, str]()
    others = [name for name in columns if name.startswith("by_") and name not in ENTRIES]
    for name, words in ENTRIES.items():
        if name == "by_limit":
            for other in others:
                found[other] = known.get(other.removeprefix("by_"), "a rule of another package")
        found[name] = words
    return found


def why(columns: Columns, at: float, rules: Mapping[str, str] | None = None) -> Why:
    """Return the ledger of the period at a time.

    Args:
        columns: Columns of a recording with a ledger, each of shape (n,).
        at: Time since the first row [s]; the last period that has begun by then is taken.
        rules: Rules of other packages, and the reason of each.

    Raises:
        SettingError: The time is outside the recording.
    """
    t = columns["t"] - columns["t"][0]
    if not 0.0 <= at <= float(t[-1]):
        raise SettingError("--at", f"{at:g} s", f"from 0 to {t[-1]:.3f} s, in the recording")
    i = int(np.searchsorted(t, at, side="right")) - 1
    row = {name: float(column[i]) for name, column in columns.items()}
    force = math.sqrt(row["fx"] ** 2 + row["fy"] ** 2 + row["fz"] ** 2)
    released = math.isfinite(row["reason"]) and int(row["reason"]) & RELEASED
    entries = tuple(
        Entry(
            name.removeprefix("by_"), row[name], _TAKEN_AWAY.get(name, words) if released else words
        )
        for name, words in entries_in(columns, rules).items()
    )
    spent = {words: row[name] for name, words in SPENT.items()}
    server = tuple(
        Entry(name.removeprefix("tick_"), row[name], words) for name, words in TICK.items()
    )
    reasons = _reasons(row, force)
    return Why(
        float(t[i]), force, entries, server, spent, row["budget"], reasons,
        _sentence(force, entries, row, spent, reasons),
    )  # fmt: skip


def _reasons(row: Mapping[str, float], force: float) -> tuple[str, ...]:
    """Return what held in a period besides the entries, in words."""
    flags = int(row["reason"]) if math.isfinite(row["reason"]) else 0
    found = list[str]()
    if cause := cause_in(flags):
        found.append(cause)
    if row["late"] > _LATE:
        found.append(f"the period began {1e3 * row['late']:.0f} ms late")
    if row["patch_age"] == math.inf:
        found.append("the hand leaves")
    elif flags & SILENT and row["tick"] > 0.0:
        found.append(f"the server has been silent for {row['patch_age']:.2f} s")
    elif row["patch_age"] > _OLD:
        found.append(f"the newest patch is {1e3 * row['patch_age']:.0f} ms old")
    if row["tick"] <= 0.0:
        found.append("no patch has come yet")
    words = dict(FLAGS)
    words.pop(SILENT)
    if force > 0.0 or row["tick"] <= 0.0:
        words.pop(WAITING)
    found += [line for line in flags_in(flags) if line in words.values()]
    if abs(row["held_turn"]) > _SEEN:
        found.append(f"{row['held_turn']:.2f} N of a turn of the force is held back")
    cuts = [
        f"{_signed(row[name])} by {name.removeprefix('tick_')} ({words})"
        for name, words in TICK.items()
        if abs(row[name]) > _SEEN
    ]
    new = not flags & SILENT and row["patch_age"] <= _OLD  # an old patch tells of another time
    if cuts and new:
        found.append(f"on its way to the body there was {', '.join(cuts)}")
    if row["gain_cut"] > _SOFTER and new:
        found.append(
            f"others' models stiffen the contact, so the gain is {row['gain_cut']:.0f} N/m less"
        )
    if row["lag"] > 0.0:
        found.append(f"the object answers other hands with a lag of {row['lag']:.2f} s")
    return tuple(found)


def _signed(newtons: float) -> str:
    return f"{'less' if newtons < 0.0 else 'plus'} {abs(newtons):.2f} N"


def _sentence(
    force: float,
    entries: tuple[Entry, ...],
    row: Mapping[str, float],
    spent: Mapping[str, float],
    reasons: tuple[str, ...],
) -> str:
    """Return a ledger as one sentence."""
    first, *others = entries
    if force == 0.0 and all(abs(entry.newtons) <= _SEEN for entry in entries):
        words = "The hand was given no force"
        if not reasons:
            words += ": the tip is above the surface"
        return "; ".join([words, " and ".join(reasons)]).rstrip("; ") + "."
    parts = [f"{first.newtons:.2f} N by the surface"]
    parts += [
        f"{_signed(entry.newtons)} by {entry.name}"
        for entry in others
        if abs(entry.newtons) > _SEEN
    ]
    words = f"The hand was given {force:.2f} N: {', '.join(parts)}"
    held = abs(row["by_depth"]) > _SEEN or row["held_turn"] > _SEEN or abs(row["by_gain"]) > _SEEN
    takers = [f"{name} {newtons:.4f}" for name, newtons in spent.items() if newtons > _TAKEN]
    if held and takers:
        words += f"; of the budget of {row['budget']:.4f} N went to {', '.join(takers)}"
    missing = force - sum(entry.newtons for entry in entries)
    if abs(missing) > _SUM:
        reasons = (*reasons, f"{missing:.2f} N are in no column of this recording")
    if reasons:
        words += f"; {', and '.join(reasons)}"
    return f"{words}."


def stacked(columns: Columns, start: float, end: float) -> tuple[Floats, dict[str, Floats], Floats]:
    """Return the entries of a span of time, for a picture.

    Args:
        columns: Columns of a recording with a ledger, each of shape (n,).
        start, end: Times since the first row [s].

    Returns:
        Times since the first row, shape (m,) [s]; the entries that did something, each (m,) [N];
        and the force, (m,) [N].

    Raises:
        SettingError: The span is outside the recording, or has no rows.
    """
    t = columns["t"] - columns["t"][0]
    if not 0.0 <= start < end <= float(t[-1]) + 1e-9:
        span = f"{start:g} to {end:g} s"
        raise SettingError("--from, --to", span, f"within 0 and {t[-1]:.3f} s, and not empty")
    kept = (t >= start) & (t <= end)
    if not kept.any():
        raise SettingError("--from, --to", f"{start:g} to {end:g} s", "a span with rows in it")
    force = np.sqrt(columns["fx"] ** 2 + columns["fy"] ** 2 + columns["fz"] ** 2)[kept]
    found = {name.removeprefix("by_"): columns[name][kept] for name in entries_in(columns)}
    return t[kept], {k: v for k, v in found.items() if np.abs(v).max() > _SEEN}, force
