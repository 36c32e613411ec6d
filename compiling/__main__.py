"""`python -m compiling [--again] [--beside]`: compile what has changed in this checkout."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from compiling.alone import alone
from compiling.build import CompileError, build, stale
from compiling.compiler import missing
from compiling.tools import ToolsError, tools


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m compiling")
    parser.add_argument("--again", action="store_true", help="also what has not changed")
    beside = "one after another, and not at all where another process compiles"
    parser.add_argument("--beside", action="store_true", help=beside)
    asked = parser.parse_args()
    why = missing()
    if why:
        sys.exit(f"no modules were compiled, which is slower and works: {why}")
    root = Path(__file__).parents[1]
    with alone(root, wait=not asked.beside) as mine:
        if not mine:
            return
        if not asked.again and not stale(root):
            print("compiled modules are up to date")
            return
        try:
            with tools():
                count = build(root, again=asked.again, jobs=1 if asked.beside else None)
        except (CompileError, ToolsError) as error:
            sys.exit(f"some modules stay plain Python, which is slower and works:\n{error}")
    print(f"compiled: {count} new" if count else "compiled modules are up to date")


if __name__ == "__main__":
    main()
