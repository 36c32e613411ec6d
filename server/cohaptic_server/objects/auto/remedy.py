"""A problem that keeps an object from being touched, and the option that solves it."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic_server.objects.object_file import ObjectFile


@dataclass(frozen=True, slots=True)
class Remedy:
    """A problem of a file, with its solution.

    Args:
        problem: The problem as a phrase: "the object would be 170 m long".
        remedy: The solution as a phrase: "taken to be in millimetres".
        option: The option for this solution, as on a command line.
        needed: Whether the object cannot be touched without this option; otherwise it is advice.
    """

    problem: str
    remedy: str
    option: str
    needed: bool = True

    def sentence(self) -> str:
        """Problem, solution and option in one line, for a list."""
        return f"{self.problem}: {self.remedy} ({self.option})"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """All problems of a file, and the options with which it can be touched.

    Args:
        source: The file with the proposed options.
        remedies: One remedy for each problem; together they name the proposed options.
    """

    source: ObjectFile
    remedies: tuple[Remedy, ...] = ()

    @property
    def options(self) -> str:
        """The proposed options, as on a command line."""
        return " ".join(remedy.option for remedy in self.remedies)

    @property
    def needed(self) -> list[Remedy]:
        """Remedies without which the object cannot be touched."""
        return [remedy for remedy in self.remedies if remedy.needed]
