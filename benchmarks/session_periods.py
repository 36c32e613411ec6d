"""Periods that the loops of a whole session leave out, with rubbish on the network beside them.

    python benchmarks/session_periods.py [--minutes 10] [--hostile 4] [--json FILE]

A server, two clients that press in a rhythm at 1 kHz, a page in Chromium that touches, and hostile
connections that come again and again with garbage, broken frames, floods of pings and half
messages, are processes of this machine. A period is left out where the one before was later than a
whole period; the loops count them. Wanted is at most 0.1 % of them, over ten minutes, on two cores.
It needs Chromium, and the packages of the tests.
"""

from __future__ import annotations

import asyncio
import itertools
import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

import json_report
from cohaptic.status.report import TouchStatus
from cohaptic_server.shell.listener import page_address
from cohaptic_tools.demo.processes import Process
from page_start import opened, touch
from soak_people import Count, do_harm

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the browser, which the tests have
from tests.browser.chromium import open_browser

HZ = 1000.0
LARGEST = 0.001  # share of the periods
HANDS = {"left": "180", "right": "0"}  # degrees round the balloon
_REPORTED = 10.0  # s between two lines


def attack(url: str, hostile: int, counted: multiprocessing.Queue[int]) -> None:
    """Do harm over so many connections at a time, until this process is ended."""
    count = Count()

    async def forever(k: int) -> None:
        for turn in itertools.count():
            await do_harm(url, count, seed=turn * hostile + k)
            await asyncio.sleep(0.05)  # a server that refuses at once would make this a busy loop

    async def tell() -> None:
        while True:
            await asyncio.sleep(1.0)
            counted.put(count.hostile)

    async def everybody() -> None:
        await asyncio.gather(tell(), *(forever(k) for k in range(hostile)))

    asyncio.run(everybody())


def statuses(hands: list[Process]) -> list[TouchStatus]:
    """The newest word of each client; of one that has ended, too."""
    return [TouchStatus.model_validate_json(hand.line or '{"name": ""}') for hand in hands]


def play(seconds: float, hostile: int, folder: Path) -> tuple[float, json_report.Result]:
    """One session; the largest share of periods that a loop left out, and all figures.

    Raises:
        SystemExit: A client is not touching any more.
    """
    server = Process("serve", "--port", "0", "--quiet", log=folder / "server.log")
    url = server.first_line().removeprefix("listening ")
    hands = [
        Process(
            "touch", url, "--name", name, "--angle", angle, "--rhythm-s", "4", "--json-lines",
            log=folder / f"{name}.log",
        )
        for name, angle in HANDS.items()
    ]  # fmt: skip
    counted: multiprocessing.Queue[int] = multiprocessing.Queue()
    harm = multiprocessing.Process(target=attack, args=(url, hostile, counted), daemon=True)
    attacks, missed = 0, [0] * len(hands)
    with sync_playwright() as playwright:
        browser = open_browser(playwright)
        page = opened(browser, slow=False)
        touch(page, page_address(url))
        harm.start()
        before, begin = statuses(hands), time.monotonic()
        while (passed := time.monotonic() - begin) < seconds:
            page.wait_for_timeout(1e3 * min(_REPORTED, seconds - passed))
            while not counted.empty():
                attacks = counted.get()
            now = statuses(hands)
            if any(each.state not in ("touching", "free") for each in now):
                raise SystemExit(f"a client is {[each.state for each in now]}; see {folder}")
            missed = [b.loop_missed - a.loop_missed for a, b in zip(before, now, strict=True)]
            print(f"{passed:4.0f} s: left out {missed}, {attacks} attacks", flush=True)
        harm.terminate()
        browser.close()
    for process in (*hands, server):
        process.wait()
    periods = HZ * (time.monotonic() - begin)
    worst = max(missed) / periods
    return worst, {
        "seconds": seconds,
        "attacks": attacks,
        "periods": round(periods),
        **{f"left_out_{name}": n for name, n in zip(HANDS, missed, strict=True)},
        "worst_share": worst,
    }


def main() -> None:
    """Print a line every ten seconds, and what was left out at the end."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--hostile", type=int, default=4, help="connections at a time")
    options = parser.parse_args()
    if not 0.1 <= options.minutes <= 600.0:
        parser.error(f"--minutes is {options.minutes:g}; it must be from 0.1 to 600")
    if not 0 <= options.hostile <= 64:
        parser.error(f"--hostile is {options.hostile}; it must be from 0 to 64")
    with tempfile.TemporaryDirectory() as folder:
        found, result = play(60.0 * options.minutes, options.hostile, Path(folder))
    json_report.write(options, [result])
    print(f"left out: {100.0 * found:.4f} % of the periods, at most {100.0 * LARGEST:g} % wanted")
    sys.exit(found > LARGEST)


if __name__ == "__main__":
    main()
