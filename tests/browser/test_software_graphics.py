"""Where the processor draws, the page does not wait for its pictures: each is drawn beside."""

from __future__ import annotations

from functools import partial

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live

PICTURES = 20
# What is drawn on the canvas itself, what beside it, and what is put there before it is finished;
# after two seconds the page may take a picture whose end nobody told as it is.
_COUNTS = """
(() => {
  const gl = WebGL2RenderingContext.prototype;
  window.counted = { canvas: 0, beside: 0, shown: 0, early: 0 };
  const state = new WeakMap();
  const of = (context) => {
    if (!state.has(context)) state.set(context, { bound: null, ready: false, since: 0 });
    return state.get(context);
  };
  const wrap = (name, after) => {
    const does = gl[name];
    gl[name] = function (...given) {
      const result = does.apply(this, given);
      after(of(this), given, result, this);
      return result;
    };
  };
  wrap("bindFramebuffer", (of, [where, buffer], _, context) => {
    if (where !== context.READ_FRAMEBUFFER) of.bound = buffer;
  });
  wrap("drawElements", (of) => { counted[of.bound === null ? "canvas" : "beside"] += 1; });
  wrap("fenceSync", (of) => { of.ready = false; of.since = performance.now(); });
  wrap("getSyncParameter", (of, _, status, context) => { of.ready = status === context.SIGNALED; });
  wrap("blitFramebuffer", (of) => {
    counted.shown += 1;
    if (!of.ready && performance.now() - of.since < 1900) counted.early += 1;
  });
})();
"""


def begun(visitor: Visitor) -> None:
    """Wait until pictures are drawn beside the canvas, and count from then on: the code comes late.

    By day and by night there is another picture.
    """

    def beside() -> bool:
        visitor.prefer("dark")
        visitor.prefer("light")
        visitor.page.wait_for_timeout(200)
        return bool(visitor.page.evaluate("counted.beside > 0"))

    visitor.until(beside, "a picture beside the canvas")
    visitor.page.evaluate("counted.canvas = 0")


def shows_more(visitor: Visitor, pictures: int) -> bool:
    return bool(visitor.page.evaluate("counted.shown") > pictures)


def test_a_picture_is_on_the_canvas_once_it_is_finished_and_not_before(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    ann.page.add_init_script(_COUNTS)
    ann.visit(room.address)
    begun(ann)
    ann.take_part("ann")
    ann.press()
    ann.until(partial(shows_more, ann, PICTURES), "pictures of the press")
    # Another size of the stage does not take the picture away, nor one that is being drawn.
    for width in (700, 500, 640):
        ann.page.set_viewport_size({"width": width, "height": 480})
        shown = ann.page.evaluate("counted.shown")
        ann.until(partial(shows_more, ann, shown), "the picture of another size")
    counted = ann.page.evaluate("counted")
    assert counted["canvas"] == 0
    assert counted["beside"] > PICTURES
    assert counted["early"] == 0
