"""From `cohaptic serve` of a prepared object to the first force on a hand in a page.

    python benchmarks/page_start.py [FILE] [--fix RULE] [--edge 0.05] [--starts 3] [--json FILE]

A browser is open before, on an empty page. Once the server says `listening`, it opens the room's
page; as soon as that watches, the hand enters, and once it is in the air it presses. Listed from
`listening` on: when the page shows the object, when the hand is engaged, and when it has a force.
Chromium draws in software here, on the cores that the server needs too: a machine with a graphics
card is faster. The browser is the system's own, driven by playwright (`pip install playwright`).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

import json_report
from object_start import COHAPTIC, ORGAN, described

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # for the browser, which the tests have
from tests.browser.chromium import open_browser  # noqa: E402

_PATIENCE = 60.0  # s
_POLL = 20  # ms between two looks


def main() -> None:
    """Prepare, start several times, and print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=ORGAN)
    parser.add_argument("--fix", default="z < 15%")
    parser.add_argument("--edge", type=float, default=0.05)
    parser.add_argument("--starts", type=int, default=3)
    options = parser.parse_args()
    results: list[json_report.Result] = []
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        os.environ["COHAPTIC_CACHE"] = folder
        subprocess.run([*COHAPTIC, "body", "prepare", *described(options)], check=True)
        print("\n| listening | object seen after | hand engaged after | force after |")
        print("|---|---|---|---|")
        for _ in range(options.starts):
            browser = open_browser(playwright)
            results.append(started(options, browser))
            browser.close()
    json_report.write(options, results)


def started(options: argparse.Namespace, browser: Browser) -> json_report.Result:
    """One start of the server, and the first touch from a page."""
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    begin = time.perf_counter()
    server = subprocess.Popen(
        [*COHAPTIC, "serve", "--quiet", "--port", "0", "--body", *described(options)],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert server.stdout is not None
    try:
        address = server.stdout.readline().split()[-1].replace("ws:", "http:")
        listening = time.perf_counter()
        page.goto(address)
        phase = page.locator(".lamp")
        until(page, lambda: phase.get_attribute("data-phase") == "watching")
        seen = time.perf_counter()
        page.click(".touch-button")
        until(page, lambda: shown(page, ".dock-facts") == "in the air")
        engaged = time.perf_counter()
        box = page.locator(".stage-canvas").bounding_box()
        assert box is not None
        dock, bar = page.locator(".dock").bounding_box(), page.locator(".bar").bounding_box()
        covered = (dock["height"] if dock else 0.0) - (bar["height"] if bar else 0.0)
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * (box["height"] - covered))
        page.mouse.down()
        until(page, lambda: shown(page, ".dock-force") not in ("", "0.00 N"))
        touched = time.perf_counter()
    finally:
        page.context.close()
        server.terminate()
        server.wait()
    found = {
        "listening_s": listening - begin,
        "seen_s": seen - listening,
        "engaged_s": engaged - listening,
        "first_force_s": touched - listening,
    }
    print(f"| {' | '.join(f'{value:.2f} s' for value in found.values())} |", flush=True)
    return found


def until(page: Page, condition: Callable[[], bool]) -> None:
    """Look again and again until a condition holds.

    Raises:
        TimeoutError: It never did.
    """
    deadline = time.perf_counter() + _PATIENCE
    while not condition():
        if time.perf_counter() > deadline:
            raise TimeoutError(f"the page says: {page.inner_text('body')}")
        page.wait_for_timeout(_POLL)


def shown(page: Page, selector: str) -> str:
    """Text of the first of these elements; empty where it is not seen."""
    found = page.locator(selector).first
    return found.inner_text() if found.is_visible() else ""


if __name__ == "__main__":
    main()
