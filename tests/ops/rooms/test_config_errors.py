from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import BaseModel, ValidationError

from cohaptic_ops.rooms.config_errors import ConfigError, problems_of


class Inner(BaseModel):
    number: int = 0
    either: list[str] | float = 0.0


class Outer(BaseModel):
    inner: Inner


def error_of(value: object) -> ValidationError:
    with pytest.raises(ValidationError) as error:
        Outer.model_validate(value)
    return error.value


def test_a_value_of_several_kinds_is_one_problem_with_its_key() -> None:
    found = problems_of(error_of({"inner": {"either": {}}}), "P_", "__", {})
    (problem,) = found
    assert problem.startswith("inner.either is {}; it must be ")


def test_a_value_that_the_environment_gave_names_its_variable() -> None:
    error = error_of({"inner": {"number": "x"}})
    (problem,) = problems_of(error, "P_", "__", {"p_inner__number": "x"})
    assert problem.startswith("inner.number (environment variable P_INNER__NUMBER) is 'x'")


def test_a_value_is_quoted_as_one_short_printable_line() -> None:
    (problem,) = problems_of(error_of({"inner": {"number": "\x1b[2J" + "x" * 900}}), "P_", "__", {})
    assert problem.isprintable()
    assert len(problem) < 300


def test_several_problems_are_listed_and_one_is_a_sentence() -> None:
    assert str(ConfigError(Path("a.toml"), ["port is 1"])) == "a.toml: port is 1"
    assert str(ConfigError(Path("a.toml"), ["x", "y"])) == "a.toml: 2 keys are wrong:\n  x\n  y"
