from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from hypothesis import given
from typer.testing import CliRunner

from cohaptic_server.cli.object_options import ObjectOptions, takes_object
from cohaptic_server.objects.object_file import ObjectFile
from tests.server.objects.given_options import GIVEN

seen: list[tuple[int, ObjectFile, bool]] = []


@takes_object
def command(
    first: Annotated[int, typer.Option(help="Before.")] = 1,
    *,
    options: ObjectOptions,
    last: Annotated[bool, typer.Option("--last", help="After.")] = False,
) -> None:
    """A command."""
    seen.append((first, options.of(Path("a.stl")), last))


def run(*arguments: str) -> tuple[int, ObjectFile, bool]:
    app = typer.Typer()
    app.command()(command)
    result = CliRunner().invoke(app, list(arguments))
    if result.exception is not None:
        raise result.exception
    return seen[-1]


@given(GIVEN)
def test_the_arguments_of_any_object_are_of_the_same_object(options: dict[str, Any]) -> None:
    source = ObjectFile.of(Path("a.stl"), options)
    app = typer.Typer()
    app.command()(command)
    parsed = typer.main.get_command(app)
    with parsed.make_context("command", source.to_arguments()) as context:
        parsed.invoke(context)
    assert seen[-1] == (1, source, False)


def test_with_auto_a_preparation_has_less_memory_and_time_unless_they_are_given() -> None:
    _, source, _ = run("--auto", "--max-time", "1800")
    assert (source.max_memory, source.max_time) == (2e9, 1800.0)
    _, source, _ = run("--auto", "--max-memory", "6")
    assert (source.max_memory, source.max_time) == (6e9, 120.0)
