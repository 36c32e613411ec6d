"""Where the processor time of a room goes, under users who press at 60 Hz.

    python benchmarks/room_profile.py [--users 8] [--seconds 8] [--rows 30]

A balloon in one room, served in this process; the users are in one of their own. First the time of
the processor for each patch is told as it is, then by functions, as `cProfile` counts it: that
counts a call as 0.5 us or more, so that shares of functions that call many others are too large.
"""

from __future__ import annotations

import asyncio
import cProfile
import pstats
import time

import json_report
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer
from core_users import crowd
from users_per_core import Process

_WARM_UP = 3.0  # s in which users join and forces rise


async def measure(users: int, seconds: float, profile: cProfile.Profile | None) -> float:
    """Processor time of the server for each patch [s]."""
    server = CohapticServer(Balloon(), ServerSettings(port=0, max_users=64))
    url = await server.start()
    running = asyncio.ensure_future(server.run())
    everybody = await asyncio.to_thread(Process, crowd)
    everybody.pipe.send((url, users, "plane", "press", 0.0))
    await asyncio.sleep(_WARM_UP)
    (before, _), used = await asyncio.to_thread(everybody.ask), time.process_time()
    if profile is not None:
        profile.enable()
    await asyncio.sleep(seconds)
    if profile is not None:
        profile.disable()
    used = time.process_time() - used
    (after, _) = await asyncio.to_thread(everybody.ask)
    everybody.pipe.send(False)
    await asyncio.to_thread(everybody.end)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    return used / max(1.0, float(after - before))


def main() -> None:
    """Print both."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--users", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--rows", type=int, default=30)
    options = parser.parse_args()
    each = asyncio.run(measure(options.users, options.seconds, None))
    print(f"{1e6 * each:.0f} us of the processor for each patch", flush=True)
    profile = cProfile.Profile(time.process_time)
    asyncio.run(measure(options.users, options.seconds, profile))
    pstats.Stats(profile).sort_stats("cumtime").print_stats(options.rows)
    json_report.write(options, [{"users": options.users, "server_s_per_patch": each}])


if __name__ == "__main__":
    main()
