"""The page `docs/life-of-a-force.md`: its constants are the code's, and its tests are there."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from typing import NamedTuple

import pytest

from tests.docs.blocks import ROOT

ROW = re.compile(
    r"^\| (?P<rule>[^|]+) \| (?P<constant>[^|]+) \|[^|]+"
    r"\| `(?P<file>[^`]+)` \| `(?P<test>[^`]+)` \|$"
)
CONSTANT = re.compile(r"`(?P<name>[\w.]+)` = (?P<value>[\d.]+)")


class Rule(NamedTuple):
    """One row of the page."""

    rule: str
    constant: str
    file: str
    test: str


def rules() -> list[Rule]:
    """All rows."""
    page = (ROOT / "docs/life-of-a-force.md").read_text(encoding="utf-8")
    by_hand = re.sub(r"<!-- \w+: written by.*?<!-- end of the chain -->", "", page, flags=re.S)
    rows = [line for line in by_hand.splitlines() if line.startswith("| ")]
    found = [ROW.match(row) for row in rows if not row.startswith("| rule |")]
    assert all(found), "a row without one module and one test in backticks at its end"
    return [Rule(*match.groups()) for match in found if match]


RULES = rules()


def test_the_page_has_all_rows() -> None:
    assert len(RULES) >= 25


@pytest.mark.parametrize("rule", RULES, ids=[rule.rule[:40] for rule in RULES])
def test_a_rule_has_its_constant_and_its_test(rule: Rule) -> None:
    module = import_module(rule.file.removesuffix(".py").replace("/", "."))
    constant = CONSTANT.match(rule.constant)
    if constant is None:
        assert rule.constant == "none"
    else:
        owner, _, field = constant["name"].rpartition(".")
        if owner:  # a setting, by its default
            value = inspect.signature(getattr(module, owner)).parameters[field].default
        else:
            value = getattr(module, field)
        assert value == float(constant["value"])
    file, _, name = rule.test.partition("::")
    assert re.search(rf"^def {name}\(", (ROOT / file).read_text(encoding="utf-8"), re.M)
