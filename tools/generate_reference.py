"""Write the tables of public names into the pages of reference, so that they read without a build.

    python tools/generate_reference.py [--check]

A name comes from the package's `__all__`, its sentence from its docstring, and the arguments of a
function from its signature. With --check nothing is written, and the status is 1 if a page is not
current.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("cohaptic", "cohaptic_server", "cohaptic_client", "cohaptic_experiments")
_BLOCK = re.compile(r"(<!-- generated: names -->\n)(.*?)(<!-- end -->)", re.S)


def page_of(package: str) -> Path:
    """Return the page of reference of a package."""
    return ROOT / f"docs/reference/{package}.md"


def names_of(package: str) -> list[str]:
    """Return the public names of a package, but its version, without regard to capitals."""
    names = importlib.import_module(package).__all__
    return sorted((name for name in names if not name.startswith("_")), key=str.lower)


def line_of(package: str, name: str) -> str:
    """Return the line of a table for one public name."""
    value = getattr(importlib.import_module(package), name)
    shown = f"`{name}`"
    if inspect.isfunction(value):
        arguments = [
            f"{'*' * (argument.kind in (inspect.Parameter.VAR_POSITIONAL,))}"
            f"{'**' * (argument.kind is inspect.Parameter.VAR_KEYWORD)}{argument.name}"
            for argument in inspect.signature(value).parameters.values()
        ]
        shown = f"`{name}({', '.join(arguments)})`"
    if not (inspect.isclass(value) or inspect.isfunction(value)):
        return f"| {shown} | A constant; its module has the reason. |"
    text = inspect.getdoc(value) or ""
    sentence = " ".join(text.partition("\n\n")[0].split())
    # Links of the built pages, as words.
    sentence = re.sub(r"\[(`[^`]+`)\]\[[^\]]+\]", r"\1", sentence)
    return f"| {shown} | {sentence.replace('|', chr(92) + '|')} |"


def table_of(package: str) -> str:
    """Return the table of all public names of a package."""
    lines = [line_of(package, name) for name in names_of(package)]
    return "\n".join(["| name | |", "| --- | --- |", *lines]) + "\n"


def with_table(page: str, table: str) -> str:
    """Return a page with its table replaced; raise ValueError if it has not one place for it."""
    page, places = _BLOCK.subn(lambda block: block[1] + table + block[3], page)
    if places != 1:
        raise ValueError(f"the page has {places} places for a table, and needs one")
    return page


def main() -> int:
    """Write or check the pages; return the status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    stale = list[str]()
    for package in PACKAGES:
        path = page_of(package)
        before = path.read_text(encoding="utf-8")
        after = with_table(before, table_of(package))
        if before == after:
            continue
        stale.append(str(path.relative_to(ROOT)))
        if not check:
            path.write_text(after, encoding="utf-8")
    if stale:
        print(f"{'not current' if check else 'written'}: {', '.join(stale)}")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
