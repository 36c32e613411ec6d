"""A thing that keeps an object from being touched, and the option that does something about it."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic_server.objects.object_file import ObjectFile


@dataclass(frozen=True, slots=True)
class Remedy:
    """One finding about a file.

    Args:
        problem: What is wrong, a phrase: "the object would be 170 m long".
        remedy: What is done about it, a phrase: "taken to be in millimetres".
        option: The option that does so, as on a command line.
        needed: Whether the object cannot be touched without it; otherwise it is advice.
    """

    problem: str
    remedy: str
    option: str
    needed: bool = True

    def sentence(self) -> str:
        """All of it, for a list."""
        return f"{self.problem}: {self.remedy} ({self.option})"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What is wrong with a file, and the options with which it can be touched.

    Args:
        source: The file with the options that are proposed.
        remedies: What these options are for, one remedy for each.
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
