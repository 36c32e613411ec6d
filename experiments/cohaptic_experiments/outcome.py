"""Options and outcome of an experiment, as values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Progress = Callable[[float], None]  # share of an experiment that is done, 0 to 1
Number = float | int | str | None | list[float] | list[float | None]


def part(progress: Progress, begin: float, fraction: float) -> Progress:
    """Progress of a part that begins at `begin` and is `fraction` of the experiment."""

    def within(done: float) -> None:
        progress(begin + fraction * done)

    return within


@dataclass(frozen=True, slots=True)
class Options:
    """Options of every experiment.

    Args:
        seed: Seed of everything that is random.
        quick: Shorter and coarser, for tests.
        trials: Trials of a campaign (`hands`).
        trial: Only this one of it.
        cluster: Address of a cluster's engine, on whose machines a campaign runs; may be empty.
    """

    seed: int = 0
    quick: bool = False
    trials: int = 2000
    trial: int | None = None
    cluster: str = ""


@dataclass(frozen=True, slots=True)
class Check:
    """One sentence with a measurement and the limits between which it holds.

    Args:
        sentence: What should hold, with the unit of the numbers.
        measured: Measured value.
        low: Least value that passes.
        high: Largest value that passes.
    """

    sentence: str
    measured: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        """Whether it holds; NaN does not."""
        return bool(self.low <= self.measured <= self.high)


def at_most(sentence: str, measured: float, limit: float) -> Check:
    """A check from above."""
    return Check(sentence, measured, -float("inf"), limit)


def at_least(sentence: str, measured: float, limit: float) -> Check:
    """A check from below."""
    return Check(sentence, measured, limit, float("inf"))


def near(sentence: str, measured: float, expected: float, rel: float) -> Check:
    """A check that a positive measurement equals `expected` up to the relative error `rel`."""
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
    """Outcome of an experiment.

    Args:
        figure: The picture.
        table: The data in it.
        numbers: Further results by name; notes as text.
        checks: Decide the verdict.
    """

    figure: Figure
    table: Table
    numbers: Mapping[str, Number]
    checks: tuple[Check, ...]

    @property
    def holds(self) -> bool:
        """The verdict: every check passes, and there is one."""
        return bool(self.checks) and all(check.passed for check in self.checks)
