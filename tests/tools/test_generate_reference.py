"""The tables of public names are current, and a page without a place for one is refused."""

from __future__ import annotations

import pytest

from generate_reference import PACKAGES, names_of, page_of, table_of, with_table


@pytest.mark.parametrize("package", PACKAGES)
def test_the_tables_are_current(package: str) -> None:
    page = page_of(package).read_text(encoding="utf-8")
    assert with_table(page, table_of(package)) == page, "run make reference"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_has_a_line_with_a_sentence(package: str) -> None:
    lines = table_of(package).splitlines()[2:]
    assert len(lines) == len(names_of(package))
    assert all(line.rstrip(" |").endswith((".", "?", ":")) for line in lines)


def test_a_page_without_a_place_is_refused() -> None:
    with pytest.raises(ValueError, match="0 places"):
        with_table("# a page\n", "")
