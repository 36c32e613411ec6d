from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.errors import SettingError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.cli.object_options import ObjectOptions, takes_object
from cohaptic_server.objects.object_file import ObjectFile

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


def test_without_options_it_is_the_plain_object() -> None:
    assert run() == (1, ObjectFile(Path("a.stl")), False)


def test_every_option_reaches_the_object_and_back() -> None:
    source = ObjectFile(
        Path("a.stl"),
        "",
        0.01,
        0.07,
        True,
        SolidSettings(1e4, 0.3, 0.01, 1),
        Path("bone.stl"),
        500,
        0.002,
    )
    arguments = ["--first", "2", *source.to_arguments(), "--last"]
    assert run(*arguments) == (2, source, True)


def test_the_options_stand_where_the_parameter_stood() -> None:
    app = typer.Typer()
    app.command()(command)
    names = [parameter.name for parameter in typer.main.get_command(app).params]
    assert names[:2] == ["first", "young"]
    assert names.index("auto") + 1 == names.index("last")


def test_an_option_out_of_range_is_refused() -> None:
    with pytest.raises(SettingError, match="--edge"):
        run("--edge", "3")
