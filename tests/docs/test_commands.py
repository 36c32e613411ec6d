"""Every command that README and docs show is one of the command line, with options that it has."""

from __future__ import annotations

import re
import shlex
from typing import Any

import pytest
import typer

from cohaptic.cli.app import build_app
from tests.docs.blocks import EVERY_PAGE, PAGES, ROOT, blocks

_COHAPTIC = re.compile(r"(?:sudo )?(?:\.venv/bin/)?cohaptic (?P<arguments>.+)")
SHOWN = [
    (block.page, found["arguments"])
    for block in blocks()
    for command in block.commands
    if (found := _COHAPTIC.match(command)) is not None
]
_FENCED = re.compile(r"^```.*?^```", re.S | re.M)
NAMED = [
    (page.relative_to(ROOT).as_posix(), command.partition(" > ")[0])
    for page in PAGES
    for command in re.findall(r"`cohaptic ([a-z][^`]+)`", _FENCED.sub("", page.read_text("utf-8")))
]


def test_a_file_that_a_page_includes_is_there() -> None:
    """A formatter has written such a mark as a comparison before."""
    included = 0
    for page in EVERY_PAGE:
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


def understood(group: Any, command: str) -> None:
    """Raises as the command line would, before it does anything."""
    context, found = group.make_context("cohaptic", shlex.split(command, comments=True)), group
    while rest := [*getattr(context, "_protected_args", []), *context.args]:
        if not hasattr(found, "resolve_command"):
            break
        name, found, rest = found.resolve_command(context, rest)
        context = found.make_context(name, rest, parent=context)
    assert found is not group


@pytest.mark.parametrize(("page", "command"), SHOWN)
def test_a_command_that_a_page_shows_is_understood(group: Any, page: str, command: str) -> None:
    understood(group, command)


@pytest.mark.parametrize(("page", "command"), NAMED)
def test_a_command_that_a_sentence_names_is_one(group: Any, page: str, command: str) -> None:
    """With what it leaves to its reader left out: a file, a key, a number."""
    try:
        understood(group, command)
    except Exception as error:
        # By name: typer brings classes of its own for click's.
        if type(error).__name__ not in ("MissingParameter", "BadOptionUsage"):
            raise
