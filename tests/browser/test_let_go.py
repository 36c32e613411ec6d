"""Whatever ends a press, the force on the hand ends with it, and the next press works."""

from __future__ import annotations

import math

import pytest

from cohaptic_server.bodies.balloon.balloon import BalloonSettings
from tests.browser.conftest import Open
from tests.browser.looking_back import replays
from tests.browser.room import Room
from tests.browser.test_gamepad import come, in_use
from tests.browser.test_gamepad import press as pull_the_trigger
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live

# So large that nothing stands before the middle of the body.
WIDE = Look(1024, 720)
RHYTHM = ("--angle", "-80", "--depth-mm", "30", "--rhythm-s", "2")
# A tab in the background: it is told so, and no picture is asked for until it is seen again.
_ASLEEP = """
(() => {
  const ask = window.requestAnimationFrame.bind(window);
  let waiting = [];
  window.requestAnimationFrame = (act) =>
    ask((at) => { if (window.asleep) waiting.push(act); else act(at); });
  window.sleep = (asleep) => {
    window.asleep = asleep;
    Object.defineProperty(document, "hidden", { value: asleep, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
    if (!asleep) for (const act of waiting.splice(0)) ask(act);
  };
})();
"""
_LOSES = """
  const get = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (...wanted) {
    const made = get.apply(this, wanted);
    if (wanted[0] === "webgl2") window.loses = made?.getExtension("WEBGL_lose_context");
    return made;
  };
"""


def pressing(visitors: Open, room: Room, script: str = "") -> Visitor:
    """A page whose hand presses, with the button held."""
    ann = visitors(WIDE)
    if script:
        ann.page.add_init_script(script)
    ann.visit(room.address)
    ann.take_part("ann")
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force")
    return ann


def is_off(room: Room) -> None:
    """Wait until the one hand that is there has no force, as the server has it."""
    room.until(
        lambda users: bool(users) and not any(math.hypot(*u.force) for u in users.values()),
        "the hand to be off",
    )


def presses_again(ann: Visitor) -> None:
    ann.release()
    ann.until(lambda: ann.force == 0.0, "no force")
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force again")
    ann.release()
    ann.until(lambda: ann.force == 0.0, "no force again")


def test_a_tab_in_the_background_draws_nothing_and_lets_go_all_the_same(
    visitors: Open, room: Room
) -> None:
    ann = pressing(visitors, room, _ASLEEP)
    ann.page.evaluate("sleep(true)")
    is_off(room)
    ann.page.evaluate("sleep(false)")
    presses_again(ann)


def test_a_press_ends_with_the_graphics_whose_pointer_nobody_hears_any_more(
    visitors: Open, room: Room
) -> None:
    ann = pressing(visitors, room, _LOSES)
    ann.page.evaluate("loses.loseContext()")
    ann.until(lambda: "graphics" in ann.notice, "word of it")
    ann.release()
    is_off(room)
    ann.page.evaluate("loses.restoreContext()")
    ann.until(lambda: ann.notice == "", "the picture to come back")
    ann.until(ann.watches, "the picture to be drawn")
    presses_again(ann)


def test_a_window_that_loses_the_keys_lets_go_of_the_space_bar(visitors: Open, room: Room) -> None:
    ann = visitors(WIDE)
    ann.visit(room.address)
    ann.take_part("ann")
    ann.page.locator(".stage-host").focus()
    ann.page.keyboard.down(" ")
    ann.until(lambda: ann.force > 0.5, "a force by keys")
    ann.page.evaluate("dispatchEvent(new Event('blur'))")
    ann.until(lambda: ann.force == 0.0, "the hand to be off, with the key still down")
    ann.page.keyboard.up(" ")


def test_a_hand_that_does_not_press_is_not_pressed_by_a_surface_that_comes_back(
    visitors: Open, room: Room
) -> None:
    ann = visitors(WIDE)
    with room.hand("native", *RHYTHM):
        ann.visit(room.address)
        ann.until(lambda: ann.force_of("native") > 1.0, "the native hand to press")
        ann.take_part("ann")
        # Where the native hand dents it, and only then.
        for _ in range(3):
            ann.until(lambda: ann.force_of("native") > 1.0, "the native hand to press again")
            ann.press(right=0.15)
            ann.until(lambda: ann.force > 0.2, "a force")
            ann.release()
            ann.until(lambda: ann.force == 0.0, "no force")
            for _ in range(25):
                ann.page.wait_for_timeout(100)
                assert ann.known_force() < 0.3, "the hand hovers in the way of the surface"


def test_nothing_of_a_pointer_that_is_still_down_moves_the_hand_in_a_replay(
    visitors: Open, room: Room
) -> None:
    ann = visitors(WIDE)
    with room.hand("native", *RHYTHM):
        ann.visit(room.address)
        ann.take_part("ann")
        ann.page.wait_for_timeout(1000)
        ann.press(right=0.2)
        ann.until(lambda: ann.force > 0.5, "a force")
        ann.page.keyboard.press("b")
        ann.until(lambda: replays(ann), "the replay")
        ann.until(lambda: ann.force == 0.0, "the hand to let go")
        for k in range(20):
            ann.page.mouse.move(500.0 + 8.0 * k, 320.0)
            ann.page.mouse.wheel(0, -100)
            ann.page.wait_for_timeout(100)
            assert ann.known_force() == 0.0
        # It stays well off the object, which comes nearer where others let go. It goes there by a
        # step for each picture.
        off = 1.25 * BalloonSettings().radius
        room.until(
            lambda users: max(math.hypot(*user.probe) for user in users.values()) > off,
            "the hand to be well off",
        )
        # And nobody is shown a place that is one of the picture of before.
        ann.page.keyboard.press("p")
        ann.page.wait_for_timeout(700)
        assert "points" not in (ann.page.locator(".for-ears").text_content() or "")
        ann.page.keyboard.press("Escape")
        ann.until(lambda: not replays(ann), "life")
        assert ann.known_force() == 0.0
        presses_again(ann)


def test_a_trigger_that_is_held_presses_nothing_while_one_looks_back(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    come(ann, room)
    in_use(ann)
    pull_the_trigger(ann)
    ann.page.locator(".stage-host").focus()
    ann.page.keyboard.press("b")
    ann.until(lambda: replays(ann), "the replay")
    ann.until(lambda: ann.force == 0.0, "the hand to be off, with the trigger still held")
    for _ in range(15):
        ann.page.wait_for_timeout(100)
        assert ann.known_force() == 0.0
    ann.page.locator(".stage-host").focus()
    ann.page.keyboard.press("Escape")
    ann.until(lambda: not replays(ann), "life")
    pull_the_trigger(ann)  # which lets go first


def test_a_page_that_stands_still_presses_nothing_though_no_event_says_so(
    visitors: Open, room: Room
) -> None:
    """Its Worker runs on: a debugger, or a script that takes long, holds the page alone."""
    ann = pressing(visitors, room)
    ann.page.evaluate(
        """() => { setTimeout(() => { const end = performance.now() + 12000;
          while (performance.now() < end) { /* nothing else runs */ } }, 0); }"""
    )
    is_off(room)
