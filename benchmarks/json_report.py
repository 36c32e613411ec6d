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
from argparse import ArgumentParser, ArgumentTypeError, Namespace, RawTextHelpFormatter
from collections.abc import Mapping, Sequence
from pathlib import Path

from cohaptic import __version__
from cohaptic.cli.output import check_output
from cohaptic.errors import SettingError

Result = Mapping[str, float | int | str | bool | None]


def parser(description: str | None) -> ArgumentParser:
    """A parser of command lines that has the option `--json FILE`.

    Args:
        description: Docstring of the benchmark.
    """
    made = ArgumentParser(description=description, formatter_class=RawTextHelpFormatter)
    made.add_argument("--json", type=_output, help="also write the results to this file")
    return made


def _output(text: str) -> Path:
    try:
        check_output("--json", path := Path(text))
    except SettingError as error:
        raise ArgumentTypeError(str(error)) from error
    return path


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
        "options": {name: _json(value) for name, value in vars(options).items() if name != "json"},
        "results": [{name: _json(value) for name, value in row.items()} for row in results],
    }
    options.json.write_text(json.dumps(report, indent=2, allow_nan=False, default=str) + "\n")


def _json(value: object) -> object:
    """The value as JSON can represent it."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
