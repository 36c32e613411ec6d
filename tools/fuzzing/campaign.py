"""Reads one fuzzed file after another, counts what becomes of them, and keeps those that fail."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fuzzing.cases import Case
from fuzzing.drafts import Draft
from fuzzing.judging import FAULTS, HUNG, READ, REFUSED, Judge, Verdict

TRIES, HANGING_TRIES = 150, 10  # readings to make a file shorter, and one that takes all its time
_ALIKE = 2  # files that are kept of one fault of one format


@dataclass(slots=True)
class Report:
    """What became of the files.

    Args:
        states: Number of files by kind and state.
        faults: Number of files by kind, state and place of the fault.
        kept: Name, state, place, words and length of each file that was kept.
    """

    states: Counter[tuple[str, str]] = field(default_factory=Counter[tuple[str, str]])
    faults: Counter[tuple[str, str, str]] = field(default_factory=Counter[tuple[str, str, str]])
    kept: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])

    def row(self, kinds: Iterable[str]) -> dict[str, int]:
        """Number of files of some kinds, and of those in each state."""
        chosen = list(kinds)
        counts = {s: sum(self.states[kind, s] for kind in chosen) for s in (READ, REFUSED, *FAULTS)}
        return {"files": sum(counts.values()), **counts}


def fuzz(
    some: Iterable[Case],
    judge: Judge,
    keep: Path | None = None,
    tell: Callable[[int, Report], None] = lambda count, report: None,
) -> Report:
    """Read files, and keep a shorter one of those that show a fault.

    Args:
        some: The files.
        judge: Reads a file and gives the verdict.
        keep: Folder for files that show a fault; None keeps none.
        tell: Called after each file with the number of files and the report so far.
    """
    report = Report()
    with tempfile.TemporaryDirectory() as folder:

        def judged(draft: Draft, one: Case) -> Verdict:
            file = Path(folder) / f"fuzzed{one.kind}"
            file.write_bytes(draft.packed())
            return judge(file, one.simplify)

        for count, one in enumerate(some, start=1):
            found = judged(one.draft, one)
            report.states[one.kind, found.state] += 1
            if found.bad:
                fault = one.kind, found.state, found.where
                report.faults[fault] += 1
                if keep is not None and report.faults[fault] <= _ALIKE:
                    report.kept.append(_kept(one, found, judged, keep))
            tell(count, report)
    return report


def _kept(
    one: Case, found: Verdict, judged: Callable[[Draft, Case], Verdict], keep: Path
) -> dict[str, Any]:
    """Keep a file that shows a fault, as short as it can be; return a description of it."""

    def fails(draft: Draft) -> bool:
        return judged(draft, one).like(found)

    short = shrunk(one.draft, fails, HANGING_TRIES if found.state == HUNG else TRIES).packed()
    keep.mkdir(parents=True, exist_ok=True)
    (keep / one.name).write_bytes(short)
    return {
        "file": one.name,
        "draft": one.draft.name,
        "state": found.state,
        "where": found.where,
        "words": found.words,
        "bytes": len(short),
        "bytes_before": len(one.draft.packed()),
    }


def shrunk(draft: Draft, fails: Callable[[Draft], bool], tries: int = TRIES) -> Draft:
    """A draft from which no block can be cut any more, or the shortest within so many tries.

    The blocks are halved when none of a size can be cut (delta debugging, Zeller, Hildebrandt
    2002).

    Args:
        draft: A file that fails.
        fails: Whether a file fails in the same way.
        tries: Largest number of files that are tried.
    """
    for index in range(len(draft.pieces)):
        size = len(draft.pieces[index])
        while size and tries:
            start, cut = 0, False
            while start < len(draft.pieces[index]) and tries:
                piece = draft.pieces[index]
                shorter = draft.changed(index, piece[:start] + piece[start + size :])
                tries -= 1
                if fails(shorter):
                    draft, cut = shorter, True
                else:
                    start += size
            size = size if cut and size > 1 else size // 2
    return draft
