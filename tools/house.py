"""How many rooms lie between two hands: what a reader crosses and what a change touches.

    python tools/house.py [--list]

The counts are of `tools/count`; with --list each is followed by its modules or files.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

# Compiled modules make no calls that Python's profiler sees.
os.environ["COHAPTIC_PLAIN"] = "1"

from count import paths, places
from count.crossing import Crossing


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--list", action="store_true", help="also the modules and files")
    listed: bool = parser.parse_args().list
    with tempfile.TemporaryDirectory() as folder:
        os.environ["COHAPTIC_CACHE"] = f"{folder}/cache"
        _show_crossing("a sample, from the socket to a patch", paths.of_a_sample(), listed)
        _show_crossing("a file, from build to a body", paths.of_a_file(Path(folder)), listed)
    for name in ("simplify", "max_time"):
        files = places.of_an_option(name)
        _show(f"files that name the option {name}", len(files), _report(files), listed)
    laws, branches = places.of_a_law(), places.law_branches()
    _show("files that name one of the laws", len(laws), _report(laws), listed)
    _show("lines that ask which law it is", sum(branches.values()), _report(branches), listed)
    asked = places.asked_for_bodies()
    _show("files that ask for a concrete body", len(asked), _report(asked), listed)
    modules = places.modules()
    long = {path: lines for path, lines in modules.items() if lines > 300}
    short = {path: lines for path, lines in modules.items() if lines < 80}
    _show("modules of the core", len(modules), (), listed)
    _show("of these longer than 300 lines", len(long), _report(long), listed)
    _show("of these shorter than 80 lines", len(short), _report(short), listed)
    print(f"{sum(modules.values()):>7,}  lines of the core")
    print(f"{places.comment_share():>7.1%}  of these with a comment")
    print(f"{places.python_lines(of_tests=False):>7,}  lines of all Python but the tests")
    print(f"{places.python_lines(of_tests=True):>7,}  lines of the tests")


def _show_crossing(what: str, found: Crossing, listed: bool) -> None:
    _show(f"modules: {what}", len(found.modules), found.modules, listed)
    back = [f"{one} -> {other}" for one, other in found.returns]
    _show("returns to a module already entered", len(back), back, listed)


def _show(what: str, count: int, names: Iterable[str], listed: bool) -> None:
    print(f"{count:>7,}  {what}", flush=True)
    if listed:
        print("".join(f"           {name}\n" for name in names), end="")


def _report(files: dict[Path, int]) -> list[str]:
    return [f"{path.relative_to(places.ROOT)}: {count}" for path, count in files.items()]


if __name__ == "__main__":
    main()
