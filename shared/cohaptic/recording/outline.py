"""What a journal holds besides the values of its rows, found in one pass over its entries."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cohaptic.recording.journal import Clocks, Damage, Entry, Header, RowBlock
from cohaptic.status.row import COLUMNS

# Longest time between two rows that is no gap [s]: ten periods. A busy machine leaves single
# periods out, which `loop_missed` counts; a gap is what an analysis cannot interpolate over.
GAP = 0.01


class Gap(NamedTuple):
    """A stretch of time without rows.

    Args:
        start: Time of the last row before it, on the client's clock [s].
        end: Time of the first row after it [s].
    """

    start: float
    end: float


@dataclass
class Outline:
    """What a journal holds.

    Args:
        header: Name and columns; those of the program itself if the header is lost.
        count: Number of rows.
        first: Time of the first row, on the client's clock [s].
        last: Time of the last row [s].
        gaps: All gaps, in order.
        clocks: All states of the clocks, in order.
        damage: All damaged stretches.
    """

    header: Header = field(default_factory=lambda: Header("", COLUMNS, 0.0))
    count: int = 0
    first: float = 0.0
    last: float = 0.0
    gaps: list[Gap] = field(default_factory=list[Gap])
    clocks: list[Clocks] = field(default_factory=list[Clocks])
    damage: list[Damage] = field(default_factory=list[Damage])

    @classmethod
    def of(cls, entries: Iterable[Entry]) -> Outline:
        """Read all entries of a journal."""
        found = cls()
        for entry in entries:
            found.add(entry)
        return found

    def add(self, entry: Entry) -> None:
        """Add the next entry."""
        match entry:
            case Header():
                self.header = entry
            case Clocks():
                self.clocks.append(entry)
            case Damage():
                self.damage.append(entry)
            case RowBlock():
                self._add_rows(entry.rows)

    def _add_rows(self, rows: bytes) -> None:
        self.add_times(np.frombuffer(rows).reshape(-1, len(self.header.columns))[:, 0])

    def add_times(self, t: npt.NDArray[np.float64]) -> None:
        """Add rows of which these are the times [s], shape (n,)."""
        if not len(t):
            return
        if not self.count:
            self.first = self.last = float(t[0])
        times = np.concatenate([[self.last], t])
        for i in np.flatnonzero(np.diff(times) > GAP).tolist():
            self.gaps.append(Gap(float(times[i]), float(times[i + 1])))
        self.count += len(t)
        self.last = float(t[-1])

    @property
    def intact(self) -> bool:
        """Whether nothing is damaged but the last block, whose write was cut short."""
        return all(damage.cut_short for damage in self.damage)


def extent_in_words(outline: Outline) -> str:
    """Return how long a recording is and what it lacks, as "12.3 s, without a gap"."""
    if not outline.count:
        return "there is not one row in it"
    seconds = f"{outline.last - outline.first:.1f} s"
    if not outline.gaps:
        return f"{seconds}, without a gap"
    missing = sum(gap.end - gap.start for gap in outline.gaps)
    count = "a gap" if len(outline.gaps) == 1 else f"{len(outline.gaps)} gaps"
    return f"{seconds}, with {count} ({missing:.2f} s in all)"
