"""Results of a benchmark as a JSON file, with a description of the machine.

    {"benchmark": NAME, "version": COHAPTIC, "machine": {...}, "options": {...}, "results": [...]}

Every result is an object in SI units, named as in the printed table. Timings depend on the machine
and its load, so each benchmark also has ratios of quantities that were measured side by side.
"""

from __future__ import annotations

import json
import math
import os
import platform
import sys
from argparse import ArgumentParser, Namespace, RawTextHelpFormatter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cohaptic import __version__
from cohaptic.cli.output import new_output
from cohaptic.errors import SettingError

Result = Mapping[str, float | int | str | bool | None]


def parser(description: str | None) -> ArgumentParser:
    """A parser of command lines that has the option `--json FILE`.

    Args:
        description: Docstring of the benchmark.
    """
    made = _Parser(description=description, formatter_class=RawTextHelpFormatter)
    made.add_argument("--json", type=Path, help="also write the results to this file")
    made.add_argument("--overwrite", action="store_true", help="replace that file if it exists")
    return made


class _Parser(ArgumentParser):
    """Makes an `Output` of the option --json, and refuses a file that exists."""

    def parse_known_args(self, *args: Any, **kwargs: Any) -> Any:
        options, rest = super().parse_known_args(*args, **kwargs)
        try:
            options.json = new_output("--json", options.json, overwrite=options.overwrite)
        except SettingError as error:
            self.error(str(error))
        return options, rest


def machine() -> dict[str, str | int | None]:
    """Cores, processor, system and Python of this machine."""
    return {
        "cores": os.cpu_count(),
        "processor": platform.machine(),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
    }


def write(options: Namespace, results: Sequence[Result]) -> None:
    """Write the results to the file of `--json`, if it was given.

    Args:
        options: Options of the command line.
        results: Rows of the tables; numbers that are not finite become null.
    """
    if options.json is None:
        return
    report = {
        "benchmark": Path(sys.argv[0]).stem,
        "version": __version__,
        "machine": machine(),
        "options": {
            name: _json(value)
            for name, value in vars(options).items()
            if name not in ("json", "overwrite")
        },
        "results": [{name: _json(value) for name, value in row.items()} for row in results],
    }
    options.json.write(json.dumps(report, indent=2, allow_nan=False, default=str) + "\n")


def _json(value: object) -> object:
    """The value as JSON can represent it."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
