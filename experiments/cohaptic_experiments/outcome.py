"""What an experiment is asked and what it answers, as values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Progress = Callable[[float], None]  # share of an experiment that is done, 0 to 1
Number = float | int | str | None | list[float] | list[float | None]


def part(progress: Progress, begin: float, share: float) -> Progress:
    """Progress of one part of an experiment that begins at `begin` and is `share` of the whole."""

    def within(done: float) -> None:
        progress(begin + share * done)

    return within


@dataclass(frozen=True, slots=True)
class Options:
    """What every experiment is told.

    Args:
        seed: Of everything that is random.
        quick: Shorter and coarser, for tests.
        trials: Of a campaign (`hands`).
        trial: Only this one of it.
    """

    seed: int = 0
    quick: bool = False
    trials: int = 2000
    trial: int | None = None


@dataclass(frozen=True, slots=True)
class Check:
    """One sentence that a measurement bears out or not.

    Args:
        sentence: What should hold, with the unit of the numbers.
        measured: What came out.
        low: Least that it may be.
        high: Most that it may be.
    """

    sentence: str
    measured: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        """Whether it holds; a measurement that is no number does not."""
        return bool(self.low <= self.measured <= self.high)


def at_most(sentence: str, measured: float, limit: float) -> Check:
    """A check from above."""
    return Check(sentence, measured, -float("inf"), limit)


def at_least(sentence: str, measured: float, limit: float) -> Check:
    """A check from below."""
    return Check(sentence, measured, limit, float("inf"))


def near(sentence: str, measured: float, expected: float, rel: float) -> Check:
    """A check that a positive measurement is what theory says, but for a share `rel` of it."""
    return Check(sentence, measured, expected * (1.0 - rel), expected * (1.0 + rel))


@dataclass(frozen=True, slots=True)
class Table:
    """Data behind a figure.

    Args:
        columns: Names with their units.
        rows: Values; None where there is none.
    """

    columns: tuple[str, ...]
    rows: list[tuple[float | int | str | None, ...]]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What an experiment found.

    Args:
        figure: The picture.
        table: The data in it.
        numbers: What is worth quoting, by name; with notes as text.
        checks: What should hold.
    """

    figure: Figure
    table: Table
    numbers: Mapping[str, Number]
    checks: tuple[Check, ...]

    @property
    def holds(self) -> bool:
        """The verdict: every check passes, and there is one."""
        return bool(self.checks) and all(check.passed for check in self.checks)
