"""What a page shows of a force around a moment of a replay."""

from __future__ import annotations

import math

from tests.browser.visitor import Visitor


def forces_around(visitor: Visitor, name: str) -> list[float]:
    """What is shown of a force for some frames before and after the shown moment.

    Of a moment between two pictures the card has the picture's force and a plot the nearest
    sample's; while a hand goes in, a busy machine has those up to 0.8 N apart.
    """
    found: list[float] = []
    for key in 8 * ["ArrowLeft"] + 16 * ["ArrowRight"]:
        visitor.page.keyboard.press(key)
        visitor.catch_up()
        found.append(visitor.force_of(name))
    return [force for force in found if not math.isnan(force)]
