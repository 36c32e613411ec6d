"""Reads thousands of damaged mesh files: is each refused in a sentence, or read as a solid?

    python tools/fuzz_readers.py [--count 20000] [--seed 1] [--format .stl ...] [--keep FOLDER]
                                 [--json FILE]

Valid files of every format are written, where possible, by another library than the one that reads
them (`fuzzing/surface_files.py`, `fuzzing/volume_files.py`). Each file then gets one to four faults
(`fuzzing/mutations.py`): it is cut, bits and bytes are changed, blocks are repeated, left out or
swapped, or a number becomes 0, -1, NaN, infinite, 1e38 or a limit of a type. In packed formats most
faults are made before packing, since a reader looks no further than a wrong checksum.

What is tried is all that `cohaptic body inspect` and an upload do before the filling:
`find_problems` reads and diagnoses the file, and `prepare` reads it again with the options that
were found, checks it, and would call fTetWild (`fuzzing/judging.py`). No single reader is called,
because a reader may return numbers on which only a later step fails.

A file is read in a process with 1 GB of address space beyond its imports, and with 20 s of the
processor. These are faults of a reader: an exception that is no CohapticError, no end, the end of
the process, more memory, something accepted that is no solid, a refusal without the file's name,
and a warning of numpy's. Two files of each new fault are made shorter while they show it, and are
kept with the seed, the number and the faults as their names. The exit status is 1 if there was any
fault.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from fuzzing.campaign import Report, fuzz
from fuzzing.cases import KINDS, cases
from fuzzing.worker import Worker

KEEP = Path("out/fuzz-readers")
_EVERY = 100  # files between two lines of progress


def table(report: Report, kinds: Sequence[str]) -> list[str]:
    """Lines with the number of files of each kind by what became of them."""
    rows = {kind: report.row([kind]) for kind in kinds} | {"all": report.row(kinds)}
    heads = list(rows["all"])
    lines = [f"{'format':<8}" + "".join(f"{head:>11}" for head in heads)]
    for name, row in rows.items():
        lines.append(f"{name:<8}" + "".join(f"{row[head]:>11,}" for head in heads))
    return lines


def parsed(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line.

    Args:
        arguments: Its words; None for those of this process.
    """
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--count", type=int, default=2000, help="number of files")
    add("--seed", type=int, default=1)
    add("--format", nargs="+", choices=KINDS, default=KINDS, help="some formats only")
    add("--keep", type=Path, default=KEEP, help="folder for files that show a fault")
    add("--json", type=Path, help="also write the table and the faults to this file")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the command line says; returns the exit status."""
    options = parsed(arguments)

    def tell(count: int, report: Report) -> None:
        if count % _EVERY == 0 or count == options.count:
            faults = sum(report.faults.values())
            print(f"{count:,} of {options.count:,} files, {faults} faults", file=sys.stderr)

    with Worker(options.format) as worker:
        some = cases(options.count, options.seed, options.format)
        report = fuzz(some, worker.judge, options.keep, tell)
    print("\n".join(table(report, options.format)))
    for (kind, state, where), count in report.faults.most_common():
        print(f"{count} x {kind} {state}: {where}")
    if options.json is not None:
        found = {
            "seed": options.seed,
            "count": options.count,
            "formats": {kind: report.row([kind]) for kind in options.format},
            "faults": report.kept,
        }
        options.json.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return 1 if report.faults else 0


if __name__ == "__main__":
    sys.exit(main())
