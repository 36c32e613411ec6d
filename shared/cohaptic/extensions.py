"""Load the extensions that installed packages add to cohaptic by entry points.

Groups:
    cohaptic.commands: Subcommands of `cohaptic`, each a function or a `typer.Typer`.
    cohaptic.devices: Devices, each a `DeviceKind`.
    cohaptic.bodies: Bodies, each a class or a function that is called without arguments.
    cohaptic.rules: Rules of the haptic loop, each a law, a filter or a limit.
    cohaptic.scripting: The functions behind `cohaptic.view` and `cohaptic.record`, of the client.
    cohaptic.routes: Services of a server in addition to touching and watching, each a `Route`.

No other package can replace an entry point of cohaptic's own. If two other packages add the same
name to a group, `load` refuses both.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

from cohaptic.errors import CohapticError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")
U = TypeVar("U")
OURS = "cohaptic"
CLIENT = "cohaptic-client"  # the same sources without the server's (`client/client_build.py`)


class ExtensionError(CohapticError):
    """An entry point of an installed package cannot be used.

    Args:
        group: Group of the entry point.
        name: Name of the entry point.
        package: Package that adds the entry point.
        problem: Phrase that says why the entry point cannot be used.
    """

    def __init__(self, group: str, name: str, package: str, problem: str) -> None:
        super().__init__(group, name, package, problem)
        self.name = name
        self.package = package
        self.problem = problem

    def __str__(self) -> str:
        return f"{self.name}, which the package {self.package} adds, cannot be used: {self.problem}"


@cache
def entries(group: str) -> dict[str, tuple[EntryPoint, ...]]:
    """Return a group's entry points by name, sorted; cohaptic's own comes first under each name."""
    from importlib.metadata import entry_points  # slow to import, and a loop may not need it

    found: dict[str, list[EntryPoint]] = {}
    for entry in sorted(entry_points(group=group), key=lambda e: (package_of(e) != OURS, str(e))):
        found.setdefault(entry.name, []).append(entry)
    return {name: tuple(found[name]) for name in sorted(found)}


def added(group: str) -> list[str]:
    """Return the sorted names of a group's entry points, cohaptic's own included."""
    return list(entries(group))


def adder(group: str, name: str) -> str:
    """Return the name of the package that adds the entry point `name` to a group."""
    return package_of(entries(group)[name][0])


def package_of(entry: EntryPoint) -> str:
    """Return the name of the package that adds an entry point; `OURS` for both of our own."""
    name = entry.dist.name if entry.dist else entry.module
    return OURS if name == CLIENT else name


def load(group: str, name: str, kind: type[T], *more: type[U]) -> T | U:
    """Load the object to which an entry point refers.

    Args:
        name: Name of the entry point in the group.
        kind, more: Classes of which the object may be an instance.

    Raises:
        ExtensionError: The entry point is missing, its object cannot be imported or is of another
            class, or two other packages add the same name.
    """
    if name not in entries(group):
        raise ExtensionError(group, name, OURS, "it is not there; install cohaptic anew")
    entry, *others = entries(group)[name]
    package = package_of(entry)
    rivals = {package_of(other) for other in others} - {package}
    if rivals and package != OURS:
        raise ExtensionError(group, name, package, f"{min(rivals)} adds one of that name, too")
    try:
        found = entry.load()
    except CohapticError:
        raise
    except Exception as error:  # foreign code may raise anything; the message names its package
        if package == OURS:
            raise
        why = f"{type(error).__name__}: {error}"
        raise ExtensionError(group, name, package, why) from error
    kinds: tuple[type[Any], ...] = (kind, *more)
    if not isinstance(found, kinds):
        wanted = " or ".join(each.__name__ for each in kinds)
        why = f"{entry.value} is a {type(found).__name__} and no {wanted}"
        raise ExtensionError(group, name, package, why)
    checked: T | U = found
    return checked
