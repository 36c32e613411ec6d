"""What a resting Python hand feels of a page that touches, over a link that wavers, on real clocks.

    python benchmarks/wavering_page.py [--network WORDS] [--seconds S] [--seed N] [--json FILE]

A page in Chromium presses and slides to and fro by its mouse, once in two seconds, and a client
rests beside it; both reach the server through the relay of `wavering.py`. The client's own
recording with the link asked for is laid beside one over the same delay that does not waver. The
path of the force is given over that of a force that goes straight up and down as often: nobody
knows what the browser's hand really did. Chromium draws in software, on the cores that hands and
server need too, so it is busy here without help. It needs Chromium, and the packages of the tests.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from playwright.sync_api import sync_playwright

from cohaptic.clock import SystemClock
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import HandScript
from cohaptic.simulated.networks import read_network, words_for
from json_report import parser, write
from wavering import SETTLES, client_of, felt_in, figures, path, relayed, tell

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the page, which the tests have
from tests.browser.chromium import open_browser
from tests.browser.visitor import Visitor, visitor_of

RESTS = HandScript(math.radians(-30.0), depth=0.008)  # beside the place that a page sees first
SWAY = 2.0  # s, to and fro
WIDE = 35.0  # px to each side
MOVES = 16  # ms between two moves of the mouse, as browsers tell them
CLOCK = SystemClock()


def sway(visitor: Visitor, seconds: float) -> None:
    """Press, and slide to and fro for so long."""
    x, y = visitor.press()
    begun = CLOCK.now()
    while (now := CLOCK.now() - begun) < seconds:
        visitor.page.mouse.move(x + WIDE * math.sin(2.0 * math.pi * now / SWAY), y)
        visitor.page.wait_for_timeout(MOVES)
    visitor.release()


def measured(link: LinkSettings, seconds: float) -> dict[str, float]:
    """Return the figures of one run."""
    with (
        tempfile.TemporaryDirectory() as name,
        relayed(link, 0, folder := Path(name)) as url,
        sync_playwright() as playwright,
        open_browser(playwright) as browser,
    ):
        visitor = visitor_of(browser)
        visitor.visit(url.replace("ws:", "http:"))
        visitor.take_part("page")
        hand = client_of("rests", RESTS, url, folder, press=False)
        sway(visitor, SETTLES + seconds)
        hand.let_end()
        hand.wait(30.0)
        felt = felt_in(folder / "rests.npz", seconds)
    row = figures(felt)
    straight = 2.0 * row["swing_n"] * float(felt.t[-1] - felt.t[0]) / SWAY
    return row | {"path": path(felt.force) / straight}


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, and print a table."""
    options_of = parser(__doc__)
    options_of.add_argument("--network", default="delay=10,jitter=10", help="words for the link")
    options_of.add_argument("--seconds", type=float, default=24.0, help="of swaying that count")
    options_of.add_argument("--seed", type=int, default=0, help="of the link's draws")
    options = options_of.parse_args(arguments)
    link = replace(read_network(options.network), seed=options.seed)
    rows = [measured(one, options.seconds) for one in (LinkSettings(link.delay), link)]
    tell(rows, "steady")
    write(options, [{**row, "network": words_for(link)} for row in rows])


if __name__ == "__main__":
    main()
