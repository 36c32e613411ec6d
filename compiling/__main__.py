"""`python -m compiling [--again]`: compile what has changed in this checkout."""

from __future__ import annotations

import sys
from pathlib import Path

from compiling.build import CompileError, build
from compiling.compiler import missing


def main() -> None:
    """Entry point."""
    why = missing()
    if why:
        sys.exit(f"no modules were compiled, which is slower and works: {why}")
    try:
        count = build(Path(__file__).parents[1], again="--again" in sys.argv[1:])
    except CompileError as error:
        sys.exit(f"some modules stay plain Python, which is slower and works:\n{error}")
    print(f"compiled: {count} new" if count else "compiled modules are up to date")


if __name__ == "__main__":
    main()
