"""A mutant is the source with one small fault, and a seed draws the same ones everywhere."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mutant_making import Mutant, is_valid, mutants, sample

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


@given(st.integers(0, 2**32), st.integers(0, 40), st.integers(0, 40), st.permutations(FILES))
def test_a_seed_draws_the_same_in_any_order_and_a_larger_sample_adds(
    seed: int, few: int, more: int, order: list[str]
) -> None:
    shuffled = {name: SOURCES[name] for name in order}
    drawn = sample(SOURCES, few + more, seed)
    assert sample(shuffled, few, seed) == drawn[:few]
    assert len({(mutant.path, mutant.line) for mutant in drawn}) == few + more


def test_another_seed_draws_others() -> None:
    assert set(sample(SOURCES, 20, 0)) != set(sample(SOURCES, 20, 1))


def test_a_mutant_is_the_same_after_lines_above_it_have_moved() -> None:
    def names(found: list[Mutant]) -> list[str]:
        return [mutant.name for mutant in found]

    for path, source in SOURCES.items():
        assert names(mutants(path, b"# Moved.\n\n" + source)) == names(mutants(path, source))


def test_names_are_all_different() -> None:
    found = [mutant.name for path in SOURCES for mutant in mutants(path, SOURCES[path])]
    assert len(set(found)) == len(found) > 300


@pytest.mark.parametrize(
    ("source", "faults"),
    [
        ("a < b", {"a <= b", "a >= b"}),
        ("(a) is not (b)", {"(a) is (b)"}),
        ("a not in b", {"a in b"}),
        ("a == b < c", {"a != b < c", "a == b <= c", "a == b >= c"}),
        ("(é + ü)  *  c", {"(é - ü)  *  c", "(é + ü)  /  c"}),
        ("a and b and c", {"a or b and c", "a and b or c"}),
        ("x = not (a)", {"x = (a)"}),
        ("x = -a", {"x = a"}),
        ("x = 3", {"x = 4", "x = 2"}),
        ("x = 0", {"x = 1"}),
        ("x = 0.5, 0.0, True", {"x = 1.0, 0.0, True", "x = 0.5, 1.0, True", "x = 0.5, 0.0, False"}),
        ("x = np.min(a)", {"x = np.max(a)"}),
        ("a.b(c)", {"pass"}),
        ("a += b", {"a -= b", "pass"}),
        ("if a: b", {"if (not (a)): b"}),
        ("x = [a for a in b if c]", {"x = [a for a in b if (not (c))]"}),
        ("def f(): return a", {"def f(): return None"}),
        ("def f() -> float: return a", {"def f() -> float: return 0.0"}),
        ("def f(): a.b = c", {"def f(): pass"}),
        ("for a in b: break", {"for a in b: continue"}),
    ],
)
def test_each_kind_of_fault(source: str, faults: set[str]) -> None:
    assert made(source) == faults


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


def test_what_does_not_compile_or_warns_is_not_valid() -> None:
    source = b"x = a is b\n"
    (mutant,) = mutants("one.py", source)
    assert is_valid(mutant, source)
    assert not is_valid(mutant._replace(after="if"), source)
    assert not is_valid(mutant._replace(start=9, end=10, after="3"), source)  # `is` with a number
