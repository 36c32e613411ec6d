"""Time for a replay's page to show another moment of a long session: scenes, forces and surface.

    python benchmarks/replay_seek.py [--users 8] [--minutes 10] [--jumps 12] [--json FILE]

The session is that of `session_file.py`. Chromium, drawing in software on the same machine, opens
`cohaptic replay` at the beginning, where nobody presses, and jumps to moments far apart. A jump
ends with the frame in which nothing is on its way any more. The first has all Green's functions to
fetch besides.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

import json_report
from cohaptic.sessions.writer import SessionFile
from session_file import repeated, sampled

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.browser.chromium import open_browser

SAMPLE = 4.0  # s that are simulated
_JUMP = """async (to) => {
  const line = document.querySelector(".replay-line");
  const trouble = document.querySelector(".replay-trouble");
  const frame = () => new Promise(requestAnimationFrame);
  const begun = performance.now();
  line.value = to;
  line.dispatchEvent(new Event("input"));
  do { await frame(); } while (trouble.textContent !== "");
  return (performance.now() - begun) / 1000;
}"""


def main() -> None:
    """Print the jumps."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--users", type=int, default=8)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--jumps", type=int, default=12)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "session.mcap"
        info, entries = sampled(options.users, SAMPLE)
        file = SessionFile("--path", path, info)
        for some in repeated(entries, SAMPLE, 60.0 * options.minutes):
            for entry in some:
                file.add(entry)
        file.close()
        jumps = _jumps(path, options.jumps)
    usual, longest = float(np.median(jumps[1:])), max(jumps[1:])
    print(
        f"the first jump took {jumps[0]:.2f} s, later ones {usual:.2f} s in the median and"
        f" {longest:.2f} s at most"
    )
    row: json_report.Result = {"first_s": jumps[0], "later_p50_s": usual, "longest_s": longest}
    json_report.write(options, [row])


def _jumps(path: Path, count: int) -> list[float]:
    words = ["replay", str(path), "--no-browser", "--lifeline"]
    process = subprocess.Popen(
        [sys.executable, "-m", "cohaptic", *words], text=True, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        address = process.stdout.readline().split()[1]
        with sync_playwright() as playwright:
            page = open_browser(playwright).new_page()
            page.goto(address)
            page.wait_for_selector(".replay-trouble", state="attached")
            page.wait_for_timeout(5000)  # what a start draws and fetches
            # Far apart, and each in another stretch of scenes than all before.
            places = [(0.37 + 0.618 * k) % 0.98 + 0.01 for k in range(count)]
            return [float(page.evaluate(_JUMP, place)) for place in places]
    finally:
        process.communicate("")


if __name__ == "__main__":
    main()
