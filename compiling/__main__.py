"""`python -m compiling [--first | --again]`: compile what has changed in this checkout."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from compiling.alone import alone
from compiling.build import CompileError, build, stale
from compiling.compiler import missing
from compiling.tools import ToolsError, are_here, tools


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m compiling")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--first", action="store_true", help="only what a demo needs")
    which.add_argument("--again", action="store_true", help="also what has not changed")
    asked = parser.parse_args()
    root = Path(__file__).parents[1]
    if not asked.again and not stale(root, first=asked.first):
        return
    why = missing()
    if why:
        sys.exit(f"no modules were compiled, which is slower and works: {why}")
    with alone(root):
        # Another process may have compiled meanwhile.
        if not asked.again and not stale(root, first=asked.first):
            return
        fetched = "" if are_here() else ", with Cython and mypy that pip fetches for it"
        what = "the loop and the tick, once" if asked.first else "modules"
        print(f"compiling {what}{fetched}", flush=True)
        try:
            with tools():
                build(root, first=asked.first, again=asked.again, progress=_show)
        except (CompileError, ToolsError) as error:
            sys.exit(f"some modules stay plain Python, which is slower and works:\n{error}")


def _show(done: int, of: int) -> None:
    """Show the progress: in place on a terminal, else one line at the end."""
    if sys.stdout.isatty():
        print(f"\rcompiled {done} of {of} modules", end="\n" if done == of else "", flush=True)
    elif done == of:
        print(f"compiled {of} modules", flush=True)


if __name__ == "__main__":
    main()
