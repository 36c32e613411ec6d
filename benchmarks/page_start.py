"""From `cohaptic serve` of a prepared object to the first force on a hand in a page.

    python benchmarks/page_start.py [FILE] [--fix RULE] [--edge 0.05] [--starts 3] [--slow]
        [--store FOLDER] [--json FILE]

A browser is open before. Once the server says `listening`, it opens the room's page; as soon as the
object is seen, the hand enters, and once it is in the air it presses. The page itself notes, from
`listening` on: its first content; when the graphics have finished the first picture of the object;
when the dock says that the hand is in the air, and a force. `an empty page` is what the browser
takes for one of the server's that has nothing in it, in the same browser afterwards: not the page's
doing. Bytes are those of the page's files and messages until the first force, as they came.

With `--slow` the browser lets through 1.6 Mbit/s, 150 ms late each, as phones on a poor network
have it; the Worker's socket, through which the hand speaks, is not slowed: Chromium cannot.

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
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

import json_report
from object_start import COHAPTIC, ORGAN, described, processor_time

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # for the browser, which the tests have
from tests.browser.chromium import open_browser  # noqa: E402

_PATIENCE = 60.0  # s
_POLL = 20  # ms between two looks
_HEADINGS = (
    "listening", "an empty page", "first content", "object seen", "hand engaged", "first force",
    "bytes", "processor time of the server",
)  # fmt: skip
_SLOW = {"offline": False, "latency": 150, "downloadThroughput": 2e5, "uploadThroughput": 2e5}
_NOTES = Path(__file__).with_suffix(".js")


def main() -> None:
    """Prepare, start several times, and print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=ORGAN)
    parser.add_argument("--fix", default="z < 15%")
    parser.add_argument("--edge", type=float, default=0.05)
    parser.add_argument("--starts", type=int, default=3)
    parser.add_argument("--slow", action="store_true", help="1.6 Mbit/s, 150 ms late")
    parser.add_argument("--store", type=Path, help="folder that keeps the prepared object")
    options = parser.parse_args()
    results: list[json_report.Result] = []
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        os.environ["COHAPTIC_CACHE"] = str(options.store or folder)
        subprocess.run([*COHAPTIC, "body", "prepare", *described(options)], check=True)
        print(f"\n| {' | '.join(_HEADINGS)} |\n{'|---' * len(_HEADINGS)}|")
        for _ in range(options.starts):
            browser = open_browser(playwright)
            results.append(started(options, browser))
            browser.close()
    json_report.write(options, results)


def started(options: argparse.Namespace, browser: Browser) -> json_report.Result:
    """One start of the server, and the first touch from a page."""
    page = opened(browser, slow=options.slow)
    begin = time.time()
    server = subprocess.Popen(
        [*COHAPTIC, "serve", "--quiet", "--port", "0", "--body", *described(options)],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert server.stdout is not None
    try:
        address = server.stdout.readline().split()[-1].replace("ws:", "http:")
        listening, used = time.time(), processor_time(server.pid)
        touch(page, address)
        used = processor_time(server.pid) - used
        noted, received = page.evaluate("noted"), page.evaluate("bytes()")
        page.context.close()
        page = opened(browser, slow=options.slow)
        asked = time.time()
        page.goto(f"{address}/healthz", wait_until="commit")
        empty = page.evaluate("frame()") - asked
    finally:
        page.context.close()
        server.terminate()
        server.wait()
    steps = ("content", "seen", "engaged", "force")
    found = {
        "listening_s": listening - begin,
        "empty_page_s": empty,
        **{f"{step}_s": noted[step] - listening for step in steps},
        "bytes": received,
        "processor_s": used,
    }
    words = [f"{1e-3 * x:.0f} kB" if key == "bytes" else f"{x:.2f} s" for key, x in found.items()]
    print(f"| {' | '.join(words)} |", flush=True)
    return found


def opened(browser: Browser, *, slow: bool) -> Page:
    """An empty page that takes notes of what is opened in it."""
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.add_init_script(path=_NOTES)
    if slow:
        network: Any = page.context.new_cdp_session(page)
        network.send("Network.enable")
        network.send("Network.emulateNetworkConditions", _SLOW)
    return page


def touch(page: Page, address: str) -> None:
    """Open the page, touch the object, and return once there is a force.

    Raises:
        TimeoutError: It never came so far.
    """
    page.goto(address, wait_until="commit")
    until(page, "seen")
    (button, object_) = page.evaluate("places()")
    page.mouse.click(*button)
    until(page, "engaged")
    page.mouse.move(*object_)
    page.mouse.down()
    until(page, "force")


def until(page: Page, step: str) -> None:
    """Look again and again until the page has noted a step."""
    deadline = time.perf_counter() + _PATIENCE
    while page.evaluate(f"noted.{step} === undefined"):
        if time.perf_counter() > deadline:
            raise TimeoutError(f"waited for {step}; the page says: {page.inner_text('body')}")
        page.wait_for_timeout(_POLL)


if __name__ == "__main__":
    main()
