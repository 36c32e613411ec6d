"""A browser whose clock goes in steps of 100 ms, for privacy: its hand goes as fast as others."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room

pytestmark = pytest.mark.live

MOST = 0.02  # s; a loop that stands still for longer loses periods, web/src/touch/loop/schedule.ts

# In the haptic Worker, which has no other clock than these.
_COARSE = """() => {
  const now = performance.now.bind(performance);
  performance.now = () => 100 * Math.floor(now() / 100);
  Date.now = () => performance.timeOrigin + performance.now();
}
"""
# The page's own Workers, whose reports can be read here as well.
_LISTEN = """
(() => {
  const Plain = window.Worker;
  window.reports = [];
  window.Worker = class extends Plain {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", ({ data }) => {
        if (data.type === "state") reports.push([data.state.t, data.state.loop_stall]);
      });
    }
  };
})();
"""


def test_a_hand_whose_clock_goes_in_steps_loses_no_period_and_is_told(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    ann.page.add_init_script(_LISTEN)
    ann.visit(room.address)
    ann.until(lambda: len(ann.page.workers) == 1, "the Worker that waits for the hand")
    ann.page.workers[0].evaluate(_COARSE)
    ann.take_part("ann")
    ann.until(lambda: "steps of 100 ms" in ann.notice, "word of the clock")

    def steady() -> bool:
        """Whether no period was lost for some reports, over more than ten steps of the clock."""
        last: Any = ann.page.evaluate("reports.slice(-80)")
        whole = len(last) == 80 and last[-1][0] - last[0][0] > 1.0
        # A stall of the whole machine is no fault of the clock.
        return whole and max(stall for _, stall in last) < MOST

    ann.until(steady, "a second without a lost period")
    times: list[float] = ann.page.evaluate("reports.slice(-80).map(([t]) => t)")
    assert len(set(times)) > 40  # reports come between the steps, and samples leave as often
    ann.page.get_by_role("button", name="Put this message away").click()
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force")
    assert ann.steady_force() > 0.5
    ann.release()
