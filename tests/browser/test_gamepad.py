"""A gamepad at the page, in a browser whose `navigator.hid` is a stand-in.

Its reports are the bytes of `client/cohaptic_drivers/dualsense`, both ways: what the page
sends is read by the layout that the driver writes. The browser's own WebHID is not part of this.
"""

from __future__ import annotations

from itertools import pairwise

import pytest

from cohaptic_drivers.dualsense.reports import OFF, SIDES, encode
from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Visitor
from tests.drivers.dualsense.pad_reports import pad_report

pytestmark = pytest.mark.live

RIGHT = SIDES["right"]
# What a test may do: choose what is found, set the trigger, unplug; and read what was sent.
_STAND_IN = """
(() => {
  const pad = window.pad = { pull: 0, told: [], report: [], found: true, allowed: true };
  let timer = 0;
  const device = {
    vendorId: 0x054c, productId: 0x0ce6, productName: "DualSense", collections: [],
    opened: false, oninputreport: null,
    open: async () => {
      device.opened = true;
      timer = setInterval(() => {
        if (pad.silent) return;
        const bytes = Uint8Array.from(pad.report);
        bytes[6] = pad.pull;
        device.oninputreport?.({ reportId: bytes[0], data: new DataView(bytes.buffer, 1) });
      }, 4);
    },
    close: async () => { device.opened = false; clearInterval(timer); },
    sendReport: async (id, data) => {
      if (pad.gone) throw new Error("gone");
      pad.told.push([performance.now(), [id, ...data]]);
    },
  };
  const hid = {
    ondisconnect: null,
    requestDevice: async () => {
      if (!navigator.userActivation.isActive) throw new Error("no gesture");
      if (!pad.allowed) throw new DOMException("forbidden", "SecurityError");
      return pad.found ? [device] : [];
    },
  };
  pad.unplug = () => {
    pad.gone = true;
    clearInterval(timer);
    hid.ondisconnect?.({ device });
  };
  Object.defineProperty(navigator, "hid", { value: hid, configurable: true });
})();
"""


def come(visitor: Visitor, room: Room) -> None:
    """Into the room, with a pad beside."""
    visitor.page.add_init_script(_STAND_IN)
    visitor.visit(room.address)
    visitor.page.evaluate("(bytes) => { pad.report = bytes; }", list(pad_report()))


def choose(visitor: Visitor) -> None:
    if not visitor.page.locator("dialog[open]").is_visible():
        visitor.page.get_by_role("button", name="Use a gamepad").click()
    visitor.page.get_by_role("button", name="Choose a gamepad").click()


def says(visitor: Visitor, words: str) -> None:
    visitor.until(lambda: words in visitor.text("dialog[open] [role=status]"), words)


def pull(visitor: Visitor, how_far: int) -> None:
    visitor.page.evaluate("(pull) => { pad.pull = pull; }", how_far)


def report(visitor: Visitor) -> list[tuple[float, bytes]]:
    """Time [s] and bytes of what was sent to the pad."""
    sent = visitor.page.evaluate("pad.told")
    return [(1e-3 * t, bytes(data)) for t, data in sent]


def resists(visitor: Visitor) -> int:
    sent = report(visitor)
    data = sent[-1][1] if sent else encode(OFF, RIGHT)
    return data[RIGHT.block + 2] if data[RIGHT.block] == 1 else 0


def press(visitor: Visitor) -> None:
    """Pull the trigger until the object resists; after a pause it has to be let go of first.

    A slow page moves the tip by a small way in each picture, and needs longer with every attempt.
    """
    looks = 0

    def pressed() -> bool:
        nonlocal looks
        looks += 10
        pull(visitor, 0)
        visitor.catch_up()
        pull(visitor, 255)
        for _ in range(looks):
            visitor.page.wait_for_timeout(70)
            if visitor.force > 1.0 and resists(visitor) > 20:
                return True
        return False

    visitor.until(pressed, "the object to resist")


def in_use(visitor: Visitor) -> None:
    choose(visitor)
    says(visitor, "The gamepad is in use")
    visitor.page.keyboard.press("Escape")
    visitor.until(lambda: visitor.doing() == "in the air", "the hand to be engaged")


def test_its_trigger_presses_and_resists_and_unplugged_in_contact_the_hand_is_let_go(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    come(ann, room)
    in_use(ann)
    press(ann)
    pull(ann, 0)
    ann.until(lambda: ann.force == 0.0 and resists(ann) == 0, "the hand to be off")
    press(ann)
    ann.page.evaluate("pad.unplug()")
    says(ann, "The gamepad was unplugged. Your hand was let go.")
    ann.page.keyboard.press("Escape")
    ann.until(lambda: ann.force == 0.0, "the hand to be off")
    times = [t for t, _ in report(ann)]
    assert min(b - a for a, b in pairwise(times)) > 0.008
    assert all(len(data) == len(encode(OFF, RIGHT)) for _, data in report(ann))


def test_a_page_that_is_hidden_lets_go_and_a_pad_that_is_silent_is_told(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    come(ann, room)
    in_use(ann)
    press(ann)
    # At once: a page in the background gets no other chance. This one goes on with its pictures.
    last = ann.page.evaluate(
        """() => {
          Object.defineProperty(document, "hidden", { value: true, configurable: true });
          document.dispatchEvent(new Event("visibilitychange"));
          return pad.told.at(-1)[1];
        }"""
    )
    assert bytes(last) == encode(OFF, RIGHT)
    ann.until(lambda: ann.force == 0.0, "the hand to be off, with the trigger still held")
    press(ann)  # which lets go first
    ann.page.evaluate("pad.silent = true")
    says(ann, "The gamepad has gone silent.")
    assert report(ann)[-1][1] == encode(OFF, RIGHT)
    ann.page.evaluate("pad.silent = false")


def test_every_failure_has_its_words(visitors: Open, room: Room) -> None:
    ann = visitors()
    come(ann, room)
    ann.page.evaluate("pad.found = false")
    choose(ann)
    says(ann, "No gamepad was chosen")
    ann.page.evaluate("pad.allowed = false")
    choose(ann)
    says(ann, "does not let this page ask")
    ann.page.evaluate("[pad.found, pad.allowed] = [true, true]")
    ann.page.evaluate("pad.report = [0x31, ...Array(77).fill(128)]")
    choose(ann)

    def refused() -> bool:
        # A page that stood still before the first report took the pad for a silent one.
        if "gone silent" in ann.text("dialog[open] [role=status]"):
            choose(ann)
        return "Bluetooth is not supported" in ann.text("dialog[open] [role=status]")

    ann.until(refused, "Bluetooth to be refused")
