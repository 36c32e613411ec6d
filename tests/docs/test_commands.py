"""Every command that README and docs show is one of the command line, with options that it has."""

from __future__ import annotations

import re
import shlex
from typing import Any

import pytest
import typer

from cohaptic.cli.app import build_app
from tests.docs.blocks import EVERY_PAGE, ROOT, blocks

_COHAPTIC = re.compile(r"(?:sudo )?(?:\.venv/bin/)?cohaptic (?P<arguments>.+)")
SHOWN = [
    (block.page, found["arguments"])
    for block in blocks()
    for command in block.commands
    if (found := _COHAPTIC.match(command)) is not None
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
