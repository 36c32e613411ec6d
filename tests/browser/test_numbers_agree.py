"""What the page says in one place it does not deny in another."""

from __future__ import annotations

import re

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room

pytestmark = pytest.mark.live

# mm: half a millimetre by which facets lie below the smooth surface, from which a hand counts, and
# two roundings of a tenth.
SHOWN = 0.6
SAME = 0.02  # N


def test_how_deep_a_lone_hand_is_said_to_be_is_where_the_plot_has_its_probe(
    visitors: Open, room: Room
) -> None:
    """Alone the free surface is the resting one, below which the plot has probe and proxy."""
    ann = visitors()
    ann.visit(room.address)
    ann.press(right=0.1)
    ann.steady_force()
    force = ann.force
    deep = re.match(r"([\d.]+)\smm deep", ann.text(".dock-facts"))
    assert deep is not None
    plot = ann.page.locator(".card.own canvas.plot")
    plot.focus()
    ann.page.keyboard.press("ArrowLeft")  # the pointer is on the object; this reads 3 s ago

    def read() -> tuple[float, float] | None:
        """Depth of the probe [mm] and force [N] in the plot."""
        said = re.search(r"probe ([\d.]+).*force ([\d.]+)", ann.text(".card.own .plot-words"))
        return None if said is None else (float(said[1]), float(said[2]))

    seen: list[float] = []

    def steady() -> bool:
        at = read()
        if at is None or abs(at[1] - force) > SAME:
            return False
        seen[:] = [at[0]]
        return True

    ann.until(steady, "the steady force there")
    assert seen[0] == pytest.approx(float(deep[1]), abs=SHOWN)
