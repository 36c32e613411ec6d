"""Errors of a configuration, as sentences that name every invalid key."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cohaptic.errors import CohapticError, one_line


class ConfigError(CohapticError):
    """Error: a configuration file cannot be used.

    Args:
        path: Path of the configuration file.
        problems: One sentence for each problem, which names the key.
    """

    def __init__(self, path: Path, problems: Sequence[str]) -> None:
        super().__init__(path, tuple(problems))
        self.path = path
        self.problems = tuple(problems)

    def __str__(self) -> str:
        if len(self.problems) == 1:
            return f"{self.path}: {self.problems[0]}"
        listed = "".join(f"\n  {problem}" for problem in self.problems)
        return f"{self.path}: {len(self.problems)} keys are wrong:{listed}"


class KeyProblem(ValueError):
    """Error: a value is invalid in a table that accepts any key, such as `limits`.

    Args:
        key: Key in the table.
        value: Value in the configuration.
        limit: Condition that the value must meet.
    """

    def __init__(self, key: str, value: str, limit: str) -> None:
        super().__init__(key, value, limit)
        self.key, self.value, self.limit = key, value, limit


def problems_of(
    error: ValidationError, prefix: str, divider: str, environment: Mapping[str, str]
) -> list[str]:
    """Return one sentence for each invalid key of a configuration.

    Args:
        error: Error of pydantic, which may concern several keys.
        prefix: Prefix of the environment variables.
        divider: Separator of the parts in the name of an environment variable.
        environment: Environment variables, from which a value may come instead of the file.
    """
    names = {name.upper() for name in environment}
    found: dict[str, str] = {}
    for one in error.errors(include_url=False):
        parts = [str(part) for part in one["loc"] if part != "[key]"]
        # A value of a union type has one error for each type, whose location ends with the type.
        while parts and ("[" in parts[-1] or parts[-1] in _KINDS):
            parts.pop()
        cause = one.get("ctx", {}).get("error")
        if isinstance(cause, KeyProblem):
            parts.append(cause.key)
        key = ".".join(parts) or "the file"
        variable = prefix + divider.join(parts).upper()
        source = f" (environment variable {variable})" if variable in names else ""
        found.setdefault(key, f"{key}{source} {_words(dict(one))}")
    return list(found.values())


_KINDS = ("float", "int", "str", "bool")


def _words(one: dict[str, Any]) -> str:
    kind, value = one["type"], one_line(repr(one["input"]), 60)
    cause = one.get("ctx", {}).get("error")
    if isinstance(cause, KeyProblem):
        return f"is {one_line(repr(cause.value), 60)}; it must be {cause.limit}"
    if kind == "missing":
        return "is missing"
    if kind == "extra_forbidden":
        return "is no key that is known; see docs/how-to/serve-many-rooms.md"
    said = str(one["msg"])
    said = said.removeprefix("Input should be ").removeprefix("Value error, ")
    return f"is {value}; it must be {said}" if said != one["msg"] else f"is {value}: {said}"
