"""Every command that README and docs show is one of the command line, with options that it has."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from cohaptic.cli.app import build_app

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.S | re.M)
_COMMAND = re.compile(r"(?:\w+=\S+ )*(?:\.venv/bin/)?cohaptic (?P<arguments>.+)")
_NOT_SHELL = {"python", "toml", "nginx", "html", "json", "yaml"}


def commands(text: str) -> Iterator[str]:
    """Arguments of `cohaptic` in the blocks of a page."""
    for kind, block in _BLOCK.findall(text):
        if kind in _NOT_SHELL:
            continue
        for line in block.replace("\\\n", " ").splitlines():
            for part in re.split(r"\s(?:&&|\||>)\s", line):
                if (found := _COMMAND.match(part.strip())) is not None:
                    yield found["arguments"]


SHOWN = [
    (str(page.relative_to(ROOT)), command)
    for page in PAGES
    if "decisions" not in page.parts and page.name != "architecture.md"
    for command in commands(page.read_text(encoding="utf-8"))
]


def test_a_file_that_a_page_includes_is_there() -> None:
    """A formatter has written such a mark as a comparison before."""
    included = 0
    for page in PAGES:
        for mark in re.findall(r"^-+8 ?<.*$", page.read_text(encoding="utf-8"), re.M):
            named = re.fullmatch(r'--8<-- "([^"]+)"', mark)
            assert named is not None, f"{page}: {mark}"
            assert (ROOT / named[1]).is_file()
            included += 1
    assert included >= 3


@pytest.fixture(scope="module")
def group() -> Any:
    return typer.main.get_command(build_app())


def test_there_are_commands() -> None:
    assert len(SHOWN) > 30
    assert ("README.md", "demo --body YOUR_FILE --auto") in {
        (page, " ".join(shlex.split(command, comments=True))) for page, command in SHOWN
    }


@pytest.mark.parametrize(("page", "command"), SHOWN)
def test_a_command_that_a_page_shows_is_understood(group: Any, page: str, command: str) -> None:
    arguments = shlex.split(command, comments=True)
    context, found = group.make_context("cohaptic", list(arguments)), group
    while rest := [*getattr(context, "_protected_args", []), *context.args]:
        if not hasattr(found, "resolve_command"):
            break
        name, found, rest = found.resolve_command(context, rest)
        context = found.make_context(name, rest, parent=context)
    assert found is not group
