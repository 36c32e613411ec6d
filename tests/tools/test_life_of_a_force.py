"""What is made from the chains is current: the tables of the docs, the names of the page."""

from __future__ import annotations

from life_of_a_force import CODE, PAGE, typescript, written


def test_the_page_has_the_chains_of_today() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert written(page) == page, "run make life"


def test_the_browser_page_has_the_names_of_today() -> None:
    assert CODE.read_text(encoding="utf-8") == typescript(), "run make life"
