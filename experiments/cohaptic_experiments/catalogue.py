"""Experiments by name. A new one is a module with `NAME`, `TITLE`, `run`, and an entry below."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module

from cohaptic.errors import CohapticError, SettingError
from cohaptic_experiments.outcome import Options, Outcome, Progress

# By name: first those of the paper, in its order, then the others; with the module of each.
_MODULES = {
    "fig07a": "paper.fig07a",
    "fig07b": "paper.fig07b",
    "fig07c": "paper.fig07c",
    "fig08": "paper.fig08",
    "fig09": "paper.fig09",
    "fig10": "paper.fig10",
    "fig11": "paper.fig11",
    "ext2": "users.two_users",
    "delay": "users.delay",
    "crowd": "users.many_users",
    "slide": "sliding.slide_figure",
    "hands": "campaign.hands",
    "dyad": "dyad.comparison",
    "scale": "scale.many_rooms",
}
EXPERIMENTS = tuple(_MODULES)
_EXTRA = ("matplotlib", "numba")


class LibraryMissing(CohapticError):
    """An experiment needs a library that a plain installation does not bring."""

    def __init__(self, library: str) -> None:
        super().__init__(library)
        self.library = library

    def __str__(self) -> str:
        return f'experiments need {self.library}: pip install "cohaptic[experiments]"'


@dataclass(frozen=True, slots=True)
class Experiment:
    """One experiment.

    Args:
        name: On the command line.
        title: In one line.
        run: Runs it; raises only CohapticError on purpose.
    """

    name: str
    title: str
    run: Callable[[Options, Progress], Outcome]


def in_words() -> str:
    """All names, in groups: "paper: fig07a, ...; users: ext2, ..."."""
    groups: dict[str, list[str]] = {}
    for name, module in _MODULES.items():
        groups.setdefault(module.partition(".")[0], []).append(name)
    return "; ".join(f"{group}: {', '.join(names)}" for group, names in groups.items())


def choose(name: str) -> tuple[str, ...]:
    """The experiments that `name` selects; raises SettingError with the existing names."""
    if name == "all":
        return EXPERIMENTS
    if name not in EXPERIMENTS:
        limit = f"one of: {', '.join(EXPERIMENTS)}, all"
        raise SettingError("experiment", repr(name), limit)
    return (name,)


def load(name: str) -> Experiment:
    """Import an experiment, which needs the libraries of the extra `experiments`."""
    with extra_libraries():
        module = import_module(f"cohaptic_experiments.{_MODULES[name]}")
    return Experiment(module.NAME, module.TITLE, module.run)


@contextmanager
def extra_libraries() -> Generator[None, None, None]:
    """Turns the import error of a library of the extra into advice."""
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library not in _EXTRA:
            raise
        raise LibraryMissing(library) from error
