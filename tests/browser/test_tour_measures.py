"""What the tour claims, by the numbers that it measures itself, with the partner that it brings."""

from __future__ import annotations

import math
import re
from functools import partial

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.room import Room
from tests.browser.test_sizes import OUT
from tests.browser.visitor import PHONE, Look, Visitor

pytestmark = pytest.mark.live

SWINGS, RESTS = 0.5, 0.02  # N
WIDE = Look(1024, 720)
OCEAN = 0.24  # s there and back, web/src/tour/steps.ts
WAITING = ".tour-word + .tour-word"  # the first is on what was left out
# Keeps all that the tour says of the own force.
CLAIMS = """() => {
  window.claims = [];
  const claim = document.querySelector(".tour-claim");
  const note = () => { if (!claim.hidden) window.claims.push(claim.textContent); };
  const what = { childList: true, characterData: true, attributes: true };
  new MutationObserver(note).observe(claim, what);
}"""
STEPS = ["welcome", "press", "feel", "sheet", "ocean", "paper", "coupled", "soft", "ours", "yours"]


def measured(visitor: Visitor, name: str) -> float:
    """A number behind the large trace; nan before it is there."""
    said = visitor.page.locator(".trace").get_attribute(f"data-{name}")
    return float(said) if said else math.nan


@pytest.mark.parametrize("look", [WIDE, PHONE], ids=["window", "phone"])
def test_the_tour_brings_a_partner_and_measures_what_it_claims(
    visitors: Open, room: Room, look: Look
) -> None:
    ann = visitors(look)
    ann.visit(room.address)
    ann.page.click(".tour-button")
    # It would go on by itself, while this looks at it.
    ann.page.locator(".tour-foot button", has_text="Pause").click()
    card = ann.page.locator(".tour")

    def at(step: str) -> bool:
        return card.get_attribute("data-step") == step

    def claim(words: str) -> bool:
        return words in ann.text(".tour-claim")

    for step in STEPS:
        ann.until(partial(at, step), step)
        if step == "feel":
            # Nobody else was here: the partner is a hand in the room like any other.
            room.until(lambda users: len(users) == 2, "the partner")
            ann.until(lambda: ann.force_of("simulated partner") > 0.5, "the partner to press")
            ann.until(lambda: claim("come from others"), "the claim")
        if step == "ocean":
            ann.until(lambda: ann.text(WAITING) == "", "the longer loop to be measured")
        if step == "coupled":
            ann.until(lambda: measured(ann, "rehearsed") >= SWINGS, "the rule for one to swing")
            ann.until(lambda: claim("times a second"), "the claim")
            said = re.search(r"swing by ([\d.]+) N, ([\d.]+) times", ann.text(".tour-claim"))
            assert said is not None
            assert float(said[1]) == pytest.approx(measured(ann, "rehearsed"), abs=0.006)
            # A force that returns turned after T swings at 1 / (2 T), or at an odd multiple of it
            # if the two loops differ by a tick or two; two ticks make the fastest swing.
            assert 0.3 < float(said[2]) <= 30.0
            picture(ann, "coupled")
        if step == "ours":
            ann.until(lambda: measured(ann, "swing") <= RESTS, "the own force to rest")
            ann.until(lambda: claim("less than a finger feels"), "the claim")
            for part in (".trace", ".tour-claim"):
                # A word of a busy server's silence goes by itself.
                ann.until(partial(in_sight, ann, part), f"{part} to be in sight")
            picture(ann, "ours")
        ann.page.click(".tour-foot .primary")
    # With the tour goes who came with it.
    room.until(lambda users: users == {}, "everybody to have left")


def in_sight(visitor: Visitor, selector: str) -> bool:
    """Whether all of it is in the window, and nothing lies over its middle."""
    return bool(
        visitor.page.locator(selector).evaluate("""(node) => {
          const { left, right, top, bottom } = node.getBoundingClientRect();
          const inside = left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight;
          node.style.pointerEvents = "auto";
          const over = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
          return inside && node.contains(over);
        }""")
    )


def picture(visitor: Visitor, step: str) -> None:
    OUT.mkdir(parents=True, exist_ok=True)
    width = visitor.page.evaluate("innerWidth")
    visitor.page.screenshot(path=OUT / f"tour-{width}-{step}.png", caret="initial")


def test_the_tour_says_otherwise_where_somebody_moves(visitors: Open, room: Room) -> None:
    ann = visitors(WIDE)
    ann.visit(room.address)
    with room.hand("native", "--angle", "0", "--rhythm-s", "2"):
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press")
        ann.page.click(".tour-button")
        ann.page.locator(".tour-foot button", has_text="Pause").click()
        card = ann.page.locator(".tour")
        for step in STEPS[:4]:
            ann.until(lambda: card.get_attribute("data-step") == step, step)  # noqa: B023
            ann.page.click(".tour-foot .primary")
        ann.until(lambda: measured(ann, "swing") > SWINGS, "the others' rhythm to be felt")
        ann.until(lambda: "somebody moves" in ann.text(".tour-claim"), "the claim to say so")
        # Where somebody is, no partner comes.
        assert {"native"} == {
            name
            for name in ann.page.locator(".card[data-user] .card-name").all_inner_texts()
            if "(you)" not in name
        }
    ann.page.keyboard.press("Escape")


def test_on_a_plain_server_the_page_delays_itself_and_the_tour_judges_no_force_that_it_moved(
    visitors: Open, serve: Serve
) -> None:
    room = serve()  # lets no page add delay, nor choose a gain
    ann = visitors(WIDE)
    ann.visit(room.address)
    ann.take_part("ann")
    ann.page.click(".tour-button")
    ann.page.locator(".tour-foot button", has_text="Pause").click()
    ann.page.evaluate(CLAIMS)
    card = ann.page.locator(".tour")
    steps = [step for step in STEPS if step not in ("paper", "coupled")]
    for n, step in enumerate(steps, start=1):
        ann.until(lambda: card.get_attribute("data-step") == step, step)  # noqa: B023
        ann.until(lambda: ann.text(".tour-count") == f"{n} of 8", "its number")  # noqa: B023
        if step == "ocean":
            # Of the visitor's hand and of the partner's, as the server measures them.
            far = room.until(
                lambda users: len(users) == 2 and all(u.loop_delay > OCEAN for u in users.values()),
                "both hands to be far away",
            )
            assert all(user.loop_delay < 3.0 * OCEAN for user in far.values())
        if step in ("ocean", "soft", "ours"):
            ann.until(lambda: ann.text(WAITING) == "", f"what {step} is to show")
        if step in ("ocean", "ours"):
            ann.until(lambda: "than a finger feels" in ann.text(".tour-claim"), "the claim")
        ann.page.click(".tour-foot .primary")
    claims: list[str] = ann.page.evaluate("window.claims")
    assert any("than a finger feels" in words for words in claims)
    # Laws, depth and delay have moved the force, and nobody else has.
    assert [words for words in claims if "has not settled" in words] == []
    # Who touched before the tour still does, as near as before.
    room.until(
        lambda users: len(users) == 1 and all(u.loop_delay < OCEAN for u in users.values()),
        "the hand to be near again",
    )
