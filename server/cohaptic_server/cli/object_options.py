"""Command-line options of an object from a file, for every command that takes such an object."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from cohaptic_server.cli.option_groups import parameter, takes_values
from cohaptic_server.objects.object_file import OPTIONS, ObjectFile
from cohaptic_server.objects.option import Option


@dataclass(frozen=True, slots=True)
class ObjectOptions:
    """Options of an object from a file, as they were given.

    Args:
        given: Values by the names in `OPTIONS`; none for an option that has its default.
        auto: Whether options that are not given are chosen.
    """

    given: Mapping[str, Any] = field(default_factory=dict[str, Any])
    auto: bool = False

    @classmethod
    def read(cls, *, auto: bool = False, **values: Any) -> ObjectOptions:
        """Return the options for the values of a command line, or of a table of a file."""
        given = {
            option.name: values[option.name]
            for option in OPTIONS
            if values[option.name] not in (option.absent, [])
        }
        return cls(given, auto)

    def of(self, path: Path) -> ObjectFile:
        """Return the object in the file `path`, with these options.

        Raises:
            SettingError: An option is out of its range.
        """
        defaults = {
            option.name: option.auto for option in OPTIONS if self.auto and option.auto is not None
        }
        return ObjectFile.of(path, defaults | dict(self.given))


def made_from_options(
    body: str, options: ObjectOptions, users: int | None, relaxation: float, *, nonlinear: bool
) -> dict[str, Any]:
    """Return how a body is made, for `ServerSettings.made_from`; names and files as given.

    Args:
        body: Name in the catalogue, or path of a file.
        users: Number of users for whom the mesh of a file is chosen; None without that option.
        relaxation: Relaxation time of a viscous body [s].
        nonlinear: Whether the body is nonlinear.
    """
    return {
        "body": body,
        "nonlinear": nonlinear,
        "relaxation": relaxation,
        "users": users,
        "auto": options.auto,
        "object": {name: str(v) if isinstance(v, Path) else v for name, v in options.given.items()},
    }


def _typer_option(option: Option) -> Any:
    flags = [option.flag] if option.kind is bool else []  # without --no-repair
    return typer.Option(*flags, help=option.help, show_default=option.shown or True)


_AUTO = Annotated[
    bool,
    typer.Option(
        "--auto",
        help="Choose unit, held region, repair, mesh and softness where not given. Say why.",
    ),
]
takes_object = takes_values(
    ObjectOptions,
    ObjectOptions.read,
    [
        *(
            parameter(option.name, Annotated[option.hint, _typer_option(option)], option.absent)
            for option in OPTIONS
        ),
        parameter("auto", _AUTO, False),
    ],
    "Object from a file",
)

SimulationHz = Annotated[
    float, typer.Option("--simulation-hz", "--hz", help="Rate of the simulation, 10 to 200 [Hz].")
]
Users = Annotated[
    int | None,
    typer.Option(
        help="Make the mesh coarse enough for so many users at once; refuse where none is.",
        show_default="2 with --nonlinear, else none",
    ),
]
