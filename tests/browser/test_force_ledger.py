"""In Engineer the own force is told rule by rule, and what rules the page lacks."""

from __future__ import annotations

import pytest

from cohaptic_client.loop.chain import CHAIN
from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import SMALL, Visitor

pytestmark = pytest.mark.live

# All in one look: the next report changes every number.
_ROWS = """(rows) => rows.filter((row) => row.getBoundingClientRect().height > 0)
  .map((row) => [row.dataset.entry, Number(row.cells[1].innerText.replace("\u2212", "-"))])"""


def entries(visitor: Visitor) -> dict[str, float]:
    """What each rule does to the own force, as shown [N]; `force` is all of them together."""
    rows = visitor.page.locator(".card.own .ledger tr[data-entry]")
    return dict(rows.evaluate_all(_ROWS))


def test_a_force_is_told_rule_by_rule(visitors: Open, room: Room) -> None:
    ann = visitors(SMALL)
    ann.visit(room.address)
    ann.take_part("ann")
    ann.choose_friction("0.8")
    ann.until(lambda: ann.doing() == "in the air", "the hand to be engaged with friction")
    x, y = ann.press()
    ann.steady_force()
    ann.page.mouse.move(x + 20.0, y)
    ann.until(lambda: entries(ann).get("friction", 0.0) > 0.05, "friction to act")
    told = entries(ann)
    force = told.pop("force")
    assert told["surface"] > 0.5
    assert sum(told.values()) == pytest.approx(force, abs=0.005 * (len(told) + 1))
    assert "models" not in told
    ann.until(lambda: entries(ann)["force"] == pytest.approx(ann.force, abs=0.02), "one force")
    missing = ann.text(".ledger-lacks summary").rpartition(": ")[2].split(", ")
    assert "models" in missing
    assert missing == [rule.name for rule in CHAIN if rule.name in missing]
    ann.release()
    ann.page.click(".level")
    ann.until(lambda: not entries(ann), "the ledger to be gone with the level")
