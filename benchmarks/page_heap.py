"""Memory and long tasks of a page that touches a balloon of 2,562 vertices for a minute.

    python benchmarks/page_heap.py [--engineer] [--seconds 60] [--warm 70] [--looks 13]
        [--subdivisions 4] [--traced 10] [--trace FILE] [--json FILE]

A server owns the balloon, a second hand presses on the other side in a rhythm, and a page in
Chromium presses, slides in circles and goes deeper and back without a pause. First it does so until
what is kept of the last minute (plots, replay) is full. Then the heaps of the page and of its
haptic Worker are looked at, `--looks` times, each time by a snapshot after forced collections. A
snapshot says what a size is of: objects, which are what a leak leaves; code, which the engine
compiles anew for functions that run much, for minutes, and which is bounded by the source; what is
behind typed arrays, where caches fill up to bounds; and what the browser notes of slow tasks.

The rule: a line of least squares through the looks, and the interval in which its growth over the
time lies with 95 % confidence (`trend.py`). Objects pass where all of the interval is below what is
noise, 200 kB for the page and 100 kB for the Worker in a minute; they grow where all of it is
above; else it cannot be told, which is no pass.

Tasks over 50 ms of the page's main thread are counted by the browser's Long Tasks, by the clock: on
a machine that does other things too these are mostly the machine's. So `--traced` seconds more are
traced, and tasks counted by the thread's own processor time as well. Chromium draws in software
here (SwiftShader), on the cores that server and hands need too. Growth, what cannot be told, and a
long task by the clock end the program with 1.

It needs Chromium, and the packages of the tests. On an idle machine of two cores it takes about
three minutes.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import multiprocessing
import sys
import tempfile
import time
from multiprocessing.queues import SimpleQueue
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

import json_report
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.listener import page_address
from cohaptic_server.shell.server import CohapticServer
from cohaptic_tools.demo.processes import Process
from page_start import opened, touch
from trend import Trend, trend

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the browser, which the tests have
from browser_heap import WATCH_TASKS, Heaps, long_tasks
from tests.browser.chromium import open_browser

LARGEST = {"page": 200_000, "worker": 100_000}  # bytes of objects in a minute that are noise
_ROUND = 6.0  # s for a circle on the body
_FAR = 60  # px from its middle
_OTHER = ("--name", "other", "--angle", "100", "--rhythm-s", "3", "--json-lines")
_AFTER = 300.0  # ms after a look in which what it held up is no task of the page's
_LONG = 0.05  # s
_TIMELINE = ["toplevel", "disabled-by-default-devtools.timeline"]


def serve(subdivisions: int, said: SimpleQueue[str]) -> None:
    """Own the balloon until this process is ended."""

    async def run() -> None:
        server = CohapticServer(
            Balloon(BalloonSettings(subdivisions=subdivisions)), ServerSettings(port=0)
        )
        said.put(await server.start())
        await server.run()

    asyncio.run(run())


def press_on(page: Page, seconds: float) -> None:
    """Slide and go deeper and back, with the button held."""
    _, (x, y) = page.evaluate("places()")
    begin, notch = time.monotonic(), 0
    while (t := time.monotonic() - begin) < seconds:
        angle = 2.0 * math.pi * t / _ROUND
        page.mouse.move(x + _FAR * math.cos(angle), y + _FAR * math.sin(angle))
        if int(t) > notch:
            notch = int(t)
            page.mouse.wheel(0, -60 if notch % 2 else 60)
        page.wait_for_timeout(16)


def measured(page: Page, options: argparse.Namespace) -> tuple[json_report.Result, list[Trend]]:
    """Touch, and look at the heaps from time to time; trends of the objects of page and Worker."""
    heaps = Heaps(page)
    press_on(page, options.warm)
    times: list[float] = []
    sizes: dict[str, list[float]] = {}
    tasks: list[float] = []
    begin = time.monotonic()
    for look in range(options.looks):
        if look > 0:
            since = page.evaluate("performance.now()") + _AFTER
            press_on(page, options.seconds / (options.looks - 1))
            tasks.extend(long_tasks(page, since))
        held = heaps.held()
        times.append(time.monotonic() - begin)
        worker = next(part for name, part in held.items() if name != "page")
        for name, part in (("page", held["page"]), ("worker", worker)):
            for kind, size in part._asdict().items():
                sizes.setdefault(f"{name}_{kind}", []).append(size)
        words = "  ".join(f"{name} {1e-6 * looks[-1]:.3f} MB" for name, looks in sizes.items())
        print(f"{times[-1]:5.1f} s  {words}", flush=True)
    found: dict[str, float] = {"seconds": times[-1], "looks": options.looks}
    trends = {name: trend(times, looks) for name, looks in sizes.items()}
    for name, (least, likely, limit) in trends.items():
        found[f"{name}_bytes"] = sizes[name][-1]
        found[f"{name}_growth_bytes"] = likely
        found[f"{name}_growth_least_bytes"] = least
        found[f"{name}_growth_most_bytes"] = limit
    found["long_tasks"] = len(tasks)
    found["longest_task_s"] = 1e-3 * max(tasks, default=0.0)
    return found, [trends[f"{name}_objects"] for name in LARGEST]


def traced(browser: Browser, page: Page, options: argparse.Namespace) -> json_report.Result:
    """Tasks of the page's main thread by its own processor time, over some seconds of touching."""
    path = options.trace or Path(tempfile.mkdtemp()) / "trace.json"
    browser.start_tracing(page=page, path=path, categories=_TIMELINE)
    press_on(page, options.traced)
    browser.stop_tracing()
    events = json.loads(path.read_text())["traceEvents"]
    mains = {
        (event["pid"], event["tid"])
        for event in events
        if event["name"] == "thread_name" and event["args"]["name"] == "CrRendererMain"
    }
    spent: dict[tuple[int, int], list[float]] = {main: [] for main in mains}
    for event in events:
        thread = (event["pid"], event["tid"])
        if event["name"] == "RunTask" and thread in spent:
            spent[thread].append(1e-6 * event.get("tdur", 0))
    tasks = max(spent.values(), key=sum)  # of the busiest page, which is the one that touches
    if not tasks:
        raise ValueError("the browser has traced no task of the page")
    return {
        "traced_tasks": len(tasks),
        "long_tasks_by_processor_time": sum(task > _LONG for task in tasks),
        "longest_task_by_processor_time_s": max(tasks),
    }


def main() -> int:
    """Serve, touch, measure; 1 where something grows or holds the page up, or may do so."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--engineer", action="store_true", help="with gains, laws and plots")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--warm", type=float, default=70.0, help="s of touching before")
    parser.add_argument("--looks", type=int, default=13)
    parser.add_argument("--subdivisions", type=int, default=4, help="3: 642 vertices, 4: 2,562")
    parser.add_argument("--traced", type=float, default=10.0, help="s of touching after")
    parser.add_argument("--trace", type=Path, default=None, help="a file to keep that trace")
    options = parser.parse_args()
    context = multiprocessing.get_context("spawn")
    said = context.SimpleQueue()
    server = context.Process(target=serve, args=(options.subdivisions, said), daemon=True)
    server.start()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        url = said.get()
        other = Process("touch", url, *_OTHER, log=Path(folder) / "log")
        browser = open_browser(playwright)
        page = opened(browser, slow=False)
        page.add_init_script(WATCH_TASKS)
        touch(page, f"{page_address(url)}?view={'engineer' if options.engineer else 'people'}")
        found, trends = measured(page, options)
        found = {**found, **traced(browser, page, options)}
        page.context.close()
        browser.close()
        other.wait()
    server.terminate()
    server.join()
    for name, value in found.items():
        print(f"{name}: {value:.6g}")
    json_report.write(options, [found])
    fraction = float(found["seconds"] or 0.0) / 60.0
    verdicts = {
        name: one.verdict(fraction * limit)
        for (name, limit), one in zip(LARGEST.items(), trends, strict=True)
    }
    print(f"objects of {verdicts}; long tasks by the clock: {found['long_tasks']}")
    steady = all(verdict == "steady" for verdict in verdicts.values())
    return 0 if steady and not found["long_tasks"] else 1


if __name__ == "__main__":
    sys.exit(main())
