"""Help of every command: the first screen has what most people need, and every unit is shown."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.cli.app import build_app

SCREEN = 40  # lines
WIDTH = 80  # columns


@cache
def app() -> typer.Typer:
    return build_app()


def commands(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    yield path, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from commands(inner, (*path, name))


ALL = dict(commands(typer.main.get_command(app())))


def help_of(path: tuple[str, ...]) -> str:
    result = CliRunner().invoke(app(), [*path, "--help"], env={"COLUMNS": str(WIDTH)})
    assert result.exit_code == 0
    return result.output


@pytest.mark.parametrize("path", ALL, ids=" ".join)
def test_the_first_screen_has_what_most_people_need(path: tuple[str, ...]) -> None:
    lines = [*help_of(path).splitlines(), ""]
    assert max(map(len, lines)) <= WIDTH
    ends = lines.index("", lines.index("Options:"))
    assert ends <= SCREEN
