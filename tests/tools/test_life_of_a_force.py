"""What is made from the chains is current: the tables of the docs, the names of the page."""

from __future__ import annotations

import pytest

import cohaptic_client.loop
import cohaptic_server.world
from life_of_a_force import CODE, PAGE, typescript, value_of, written


def test_the_page_has_the_chains_of_today() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert written(page) == page, "run make life"


def test_the_browser_page_has_the_names_of_today() -> None:
    assert CODE.read_text(encoding="utf-8") == typescript(), "run make life"


def test_a_constant_that_is_nowhere_is_an_error() -> None:
    assert value_of("EXTERNAL_RATE", cohaptic_client.loop) == 20.0
    assert value_of("SafetyLimits.max_force", cohaptic_client.loop) == 10.0
    assert value_of("EFFECT_RATE", cohaptic_server.world) == 60.0
    with pytest.raises(LookupError, match="NO_SUCH"):
        value_of("NO_SUCH", cohaptic_client.loop)


def test_a_page_without_its_marks_is_refused() -> None:
    with pytest.raises(ValueError, match="has lost a mark"):
        written("nothing")
