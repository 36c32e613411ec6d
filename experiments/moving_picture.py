"""The moving picture of the README: two hands of a real demo, as its page in Chromium shows them.

    python experiments/moving_picture.py [--out docs/pictures/two-hands.gif]

Nothing is drawn for it: server, two clients with 80 ms of delay each way, and the page are those of
`cohaptic demo`, and the picture is one period of the hand that presses, at the speed it had. Needs
Chromium, and a machine that does nothing else: frames that come late are left out.
"""

from __future__ import annotations

import argparse
import base64
import io
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

WIDTH, HEIGHT = 720, 470  # px of the window
PERIOD = 5.8  # s of the hand that presses (`demo.scene`)
FRAME = 0.1  # s; browsers slow down what is faster than 50 to a second
SETTLED = 9.0  # s after which both hands are there and the page has everything


def screencast(page: Page, seconds: float) -> list[tuple[float, Image.Image]]:
    """What the page draws, each picture with its time [s]."""
    taken: list[tuple[float, Image.Image]] = []
    chrome: Any = page.context.new_cdp_session(page)

    def keep(frame: dict[str, Any]) -> None:
        picture = Image.open(io.BytesIO(base64.b64decode(frame["data"]))).convert("RGB")
        taken.append((float(frame["metadata"]["timestamp"]), picture))
        chrome.send("Page.screencastFrameAck", {"sessionId": frame["sessionId"]})

    chrome.on("Page.screencastFrame", keep)
    chrome.send("Page.startScreencast", {"format": "png", "everyNthFrame": 1})
    page.wait_for_timeout(1e3 * seconds)
    chrome.send("Page.stopScreencast")
    return taken


def evenly(taken: list[tuple[float, Image.Image]], seconds: float) -> list[Image.Image]:
    """The newest picture at each of the times that a GIF shows."""
    start = taken[-1][0] - seconds
    chosen: list[Image.Image] = []
    for k in range(round(seconds / FRAME)):
        chosen.append([picture for t, picture in taken if t <= start + k * FRAME][-1])
    return chosen


def record(address: str) -> list[Image.Image]:
    """One period of the demo at this address."""
    from tests.browser.chromium import open_browser

    with sync_playwright() as playwright:
        browser = open_browser(playwright)
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light")
        # Who has pressed before is not told how.
        page.add_init_script("localStorage.setItem('cohaptic.pressed', 'yes')")
        page.goto(address)
        page.wait_for_timeout(1e3 * SETTLED)
        taken = screencast(page, PERIOD + 1.0)
        browser.close()
    print(f"{len(taken) / (taken[-1][0] - taken[0][0]):.1f} pictures a second", file=sys.stderr)
    return evenly(taken, PERIOD)


def main() -> None:
    """Record a demo."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "docs/pictures/two-hands.gif")
    arguments = parser.parse_args()
    command = [sys.executable, "-m", "cohaptic", "demo", "--duration", "600", "--no-browser"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as demo:
        try:
            assert demo.stdout is not None
            found = next(filter(None, (re.search(r"page (http\S+)", x) for x in demo.stdout)))
            frames = record(found[1])
        finally:
            demo.send_signal(signal.SIGINT)
            demo.communicate()
    # The colours of all of it, as a GIF has 256.
    strip = Image.new("RGB", (WIDTH, HEIGHT * len(frames[::10])))
    for k, frame in enumerate(frames[::10]):
        strip.paste(frame, (0, k * HEIGHT))
    palette = strip.quantize(256)
    reduced = [frame.quantize(palette=palette) for frame in frames]
    reduced[0].save(
        arguments.out, save_all=True, append_images=reduced[1:], duration=round(1e3 * FRAME), loop=0
    )
    print(f"{arguments.out}: {len(frames)} frames, {arguments.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
