"""Lets several commands share a group of command-line options, which is defined once."""

from __future__ import annotations

import copy
import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields
from typing import Annotated, Any, get_args, get_type_hints

Command = Callable[..., None]


def takes(group: type[Any], chapter: str | None = None) -> Callable[[Command], Command]:
    """Return a decorator that gives a command one option for each field of a dataclass.

    Typer reads the options of a command from its signature. The decorated command's signature has
    one parameter for each field of the group; the command itself receives one value of type
    `group`.

    Args:
        group: Dataclass whose fields are the options; the command has exactly one parameter of this
            type.
        chapter: Chapter of the command's help that lists the options; None for the main one.
    """
    return lambda command: _with_group(command, group, chapter)


def _with_group(command: Command, group: type[Any], chapter: str | None) -> Command:
    hints = get_type_hints(command, include_extras=True)
    (taken,) = [name for name, hint in hints.items() if hint is group]
    option_hints = get_type_hints(group, include_extras=True)
    options = [
        _parameter(
            f.name,
            _in_chapter(option_hints[f.name], chapter),
            inspect.Parameter.empty if f.default is MISSING else f.default,
        )
        for f in fields(group)
    ]
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name == taken:
            parameters += options
        else:
            parameters.append(_parameter(name, hints[name], parameter.default))

    @functools.wraps(command)
    def with_options(**arguments: Any) -> None:
        values = {option.name: arguments.pop(option.name) for option in options}
        command(**arguments, **{taken: group(**values)})

    result: Any = with_options  # `Any`, since the function type has no signature to set
    result.__signature__ = inspect.Signature(parameters)
    result.__annotations__ = {p.name: p.annotation for p in parameters}
    return with_options


def _in_chapter(hint: Any, chapter: str | None) -> Any:
    kind, option = get_args(hint)
    option = copy.copy(option)
    option.rich_help_panel = chapter
    return Annotated[kind, option]


def _parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    # Keyword-only, so that a parameter without a default may follow one with a default.
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)
