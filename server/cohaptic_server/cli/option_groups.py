"""Lets several commands share a group of command-line options, which is defined once."""

from __future__ import annotations

import copy
import functools
import inspect
from collections.abc import Callable, Sequence
from dataclasses import MISSING, fields
from typing import Annotated, Any, get_args, get_type_hints

Command = Callable[..., None]


def takes(group: type[Any], chapter: str | None = None) -> Callable[[Command], Command]:
    """Return a decorator that gives a command one option for each field of a dataclass.

    Args:
        group: Dataclass whose fields are the options; the command has exactly one parameter of this
            type.
        chapter: Chapter of the command's help that lists the options; None for the main one.
    """
    hints = get_type_hints(group, include_extras=True)
    absent = inspect.Parameter.empty
    options = [
        parameter(f.name, hints[f.name], absent if f.default is MISSING else f.default)
        for f in fields(group)
    ]
    return takes_values(group, group, options, chapter)


def takes_values(
    group: type[Any],
    make: Callable[..., Any],
    options: Sequence[inspect.Parameter],
    chapter: str | None = None,
) -> Callable[[Command], Command]:
    """Return a decorator that gives a command options, whose values become one value.

    Typer reads the options of a command from its signature. The signature of the result has one
    parameter for each option; the command itself receives one value of type `group`.

    Args:
        group: Type of the value; the command has exactly one parameter of this type.
        make: Called with the values of all options, by their names; returns the value.
        options: The options, with annotations for Typer.
        chapter: Chapter of the command's help that lists the options; None for the main one.
    """
    listed = [
        parameter(one.name, _in_chapter(one.annotation, chapter), one.default) for one in options
    ]
    return lambda command: _with_options(command, group, make, listed)


def _with_options(
    command: Command,
    group: type[Any],
    make: Callable[..., Any],
    options: Sequence[inspect.Parameter],
) -> Command:
    hints = get_type_hints(command, include_extras=True)
    (taken,) = [name for name, hint in hints.items() if hint is group]
    parameters: list[inspect.Parameter] = []
    for name, own in inspect.signature(command).parameters.items():
        parameters += options if name == taken else [parameter(name, hints[name], own.default)]

    @functools.wraps(command)
    def with_options(**arguments: Any) -> None:
        values = {option.name: arguments.pop(option.name) for option in options}
        command(**arguments, **{taken: make(**values)})

    result: Any = with_options  # `Any`, since the function type has no signature to set
    result.__signature__ = inspect.Signature(parameters)
    result.__annotations__ = {p.name: p.annotation for p in parameters}
    return with_options


def _in_chapter(hint: Any, chapter: str | None) -> Any:
    kind, option = get_args(hint)
    option = copy.copy(option)
    option.rich_help_panel = chapter
    return Annotated[kind, option]


def parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    """A parameter of a command, which Typer makes into an option."""
    # Keyword-only, so that a parameter without a default may follow one with a default.
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)
