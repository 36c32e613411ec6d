"""Whatever installed packages add to cohaptic, by the entry points of a group.

Groups:
    cohaptic.commands: Subcommands of `cohaptic`, each a function or an application of typer.
    cohaptic.devices: Devices, each a `DeviceKind`.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, TypeVar

from cohaptic.errors import CohapticError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")


class ExtensionError(CohapticError):
    """A package adds something that cannot be used.

    Args:
        group: Group of its entry point.
        name: Name of its entry point.
        package: Name of the package.
        problem: The observation.
    """

    def __init__(self, group: str, name: str, package: str, problem: str) -> None:
        super().__init__(group, name, package, problem)
        self.name = name
        self.package = package
        self.problem = problem

    def __str__(self) -> str:
        return f"{self.name}, which the package {self.package} adds, cannot be used: {self.problem}"


@cache
def added(group: str) -> dict[str, EntryPoint]:
    """Entry points of a group by name, sorted; of two with one name, the one found first."""
    from importlib.metadata import entry_points  # it is slow to import, and a loop may need none

    found: dict[str, EntryPoint] = {}
    for entry in entry_points(group=group):
        found.setdefault(entry.name, entry)
    return dict(sorted(found.items()))


def load(group: str, name: str, *kinds: type[T]) -> T:
    """The object behind an entry point.

    Args:
        group: Group of the entry point.
        name: One of those that were added.
        kinds: Classes of which it may be.

    Raises:
        ExtensionError: It cannot be imported, or is of another class.
    """
    entry = added(group)[name]
    package = entry.dist.name if entry.dist else entry.value
    try:
        found = entry.load()
    except Exception as error:  # code of others: whatever it raises, one sentence says whose it is
        why = f"{type(error).__name__}: {error}"
        raise ExtensionError(group, name, package, why) from error
    if not isinstance(found, kinds):
        wanted = " or ".join(each.__name__ for each in kinds)
        why = f"{entry.value} is a {type(found).__name__} and no {wanted}"
        raise ExtensionError(group, name, package, why)
    return found
