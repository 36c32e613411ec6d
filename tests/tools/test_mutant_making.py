"""A mutant is the source with one small fault, and a seed draws the same ones everywhere."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mutant_making import mutants, sample

ROOT = Path(__file__).parents[2]
FILES = (
    "client/cohaptic_client/loop/passivity.py",
    "client/cohaptic_client/loop/safety.py",
    "server/cohaptic_server/access/tokens.py",
    "client/cohaptic_client/loop/rules/guard.py",
    "shared/cohaptic/control/laws/pi.py",
)
SOURCES = {path: (ROOT / path).read_bytes() for path in FILES}


def made(source: str) -> set[str]:
    """Sources of all mutants of a source."""
    found = mutants("one.py", source.encode())
    return {mutant.applied(source.encode()).decode() for mutant in found}


@given(st.integers(0, 2**32))
def test_a_mutant_compiles_and_differs_in_one_place(seed: int) -> None:
    (mutant,) = sample(SOURCES, 1, seed)
    source = SOURCES[mutant.path]
    fault = mutant.applied(source)
    assert fault[: mutant.start] == source[: mutant.start]
    assert source[mutant.start : mutant.end].decode() == mutant.before
    behind = len(source) - mutant.end
    assert fault[len(fault) - behind :] == source[mutant.end :]
    assert ast.dump(ast.parse(fault)) != ast.dump(ast.parse(source))
    assert source[: mutant.start].count(b"\n") + 1 == mutant.line
    assert mutant.lines[0] <= mutant.line <= mutant.lines[1]


@pytest.mark.parametrize(
    "source",
    [
        '"""1 < 2"""',
        "from a import b",
        "__all__ = ['a', 'b']",
        "Pair = tuple[int, 3] | None",
        "Pair: TypeAlias = f(1)",
        "x: f(1)",
        "def f(a: g(1)) -> h(2): ...",
        "@f(1)\ndef g(): ...",
        "raise Lost(f'{a + 1}', 2)",
        "assert a < b",
        "log.warning('%d', a + 1)",
        "x = f'{a + 1:3}'",
        "if TYPE_CHECKING: a()",
        "def f(): return None",
    ],
)
def test_what_no_test_can_see_is_left_alone(source: str) -> None:
    assert made(source) == set()
