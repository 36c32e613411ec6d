"""What a resting hand feels on real clocks over a network that wavers, beside busy processes.

    python benchmarks/wavering.py [--network WORDS] [--busy N] [--plain] [--stalls] [--json FILE]

A server and two clients are processes of their own, and all bytes between them pass through a
relay, a fourth process, that delays them as `cohaptic touch --network` would. One hand presses and
lets go, the other rests; its own recording is laid beside the same hands without a network, and
beside a run with the same delay that does not waver, on an idle machine. With --stalls both rest,
and both ways of the first one stall a hundred times, for up to a second. --busy counts processes
that compute without end; --plain runs Python that is not compiled.
"""

from __future__ import annotations

import asyncio
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

from cohaptic.clock import SystemClock
from cohaptic.simulated.delay_line import DelayLine, LinkSettings
from cohaptic.simulated.hand import HandScript, Rhythm
from cohaptic.simulated.networks import read_network, words_for
from cohaptic.vec import Vec3
from cohaptic_client.devices.simulated import INFO, SimulatedDevice
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_experiments.transparency.roughness import FAST
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.at_once import Mover, play_at_once
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.processes import Process
from json_report import parser, write

CYCLE = 4.0  # s
PRESSES = HandScript(math.pi, depth=0.012, rhythm=Rhythm(CYCLE))
RESTS = HandScript(0.0, depth=0.008)
SETTLES = 8.0  # s from joining, in which hands come to rest and the length of buffers is found
CYCLES = 8  # of the pressing hand that count
WITHIN = 0.02  # s in which a change of a resting force counts
STALLS = LinkSettings(0.02, stall=1.0, stalls=0.5)
STALLED = 130.0  # s, in which two ways stall a hundred times
BUSY = "while True: pass"
CLOCK = SystemClock()


@dataclass(frozen=True, slots=True)
class Felt:
    """What the resting hand felt.

    Args:
        t: Times, (n,) [s].
        force: Sizes of the force, (n,) [N].
        beyond: Largest change within 20 ms that its own way does not explain [N].
    """

    t: Floats
    force: Floats
    beyond: float


class Way:
    """One direction of a relayed connection: chunks come out as late as the link makes them."""

    def __init__(self, link: LinkSettings, writer: asyncio.StreamWriter) -> None:
        self._line: DelayLine[bytes] = DelayLine(link)
        self._writer = writer
        self._timer: asyncio.TimerHandle | None = None

    async def carry(self, reader: asyncio.StreamReader) -> None:
        """Pass on what comes until the connection ends."""
        with suppress(ConnectionError):
            while chunk := await reader.read(65536):
                self._line.push(chunk, CLOCK.now())
                self._run()
        while (due := self._line.next_due()) is not None and not self._writer.is_closing():
            await asyncio.sleep(max(0.0, due - CLOCK.now()))
            self._run()
        with suppress(ConnectionError):
            self._writer.close()

    def _run(self) -> None:
        due_now = self._line.pop_due(CLOCK.now())
        if self._writer.is_closing():
            return
        for chunk in due_now:
            self._writer.write(chunk)
        due = self._line.next_due()
        if due is not None and self._timer is None:
            wait = max(0.0, due - CLOCK.now())
            self._timer = asyncio.get_running_loop().call_later(wait, self._wake)

    def _wake(self) -> None:
        self._timer = None
        self._run()


async def relay(port: int, link: LinkSettings) -> None:
    """Relay connections to a port of this machine, until the process is ended.

    Only the first one stalls: the force of who is cut off fades, and what others feel of it counts.
    """
    count = 0

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal count
        own = link if count == 0 else replace(link, stalls=0.0)
        count += 2
        there, back = await asyncio.open_connection("127.0.0.1", port)
        up = Way(replace(own, seed=link.seed + count), back)
        down = Way(replace(own, seed=link.seed + count + 1), writer)
        await asyncio.gather(up.carry(reader), down.carry(there))

    server = await asyncio.start_server(connected, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


@contextmanager
def relayed(link: LinkSettings, busy: int, folder: Path) -> Generator[str]:
    """Run a server, a relay and busy processes; give the address behind the relay."""
    with ExitStack() as stack:
        server = Process("serve", "--port", "0", "--quiet", log=folder / "server.log")
        stack.callback(server.wait)
        port = server.first_line().rsplit(":", 1)[1]
        words = [sys.executable, __file__, "--relay", port, "--network", words_for(link)]
        between = subprocess.Popen(
            [*words, "--seed", str(link.seed)], stdout=subprocess.PIPE, text=True
        )
        stack.callback(between.kill)
        assert between.stdout is not None
        port = between.stdout.readline().strip()
        for _ in range(busy):
            stack.callback(subprocess.Popen([sys.executable, "-c", BUSY]).kill)
        yield f"ws://127.0.0.1:{port}"


def client_of(name: str, script: HandScript, url: str, folder: Path, *, press: bool) -> Process:
    """Start a client that records, and wait until it takes part."""
    client = Process(
        "touch", url, "--name", name, "--angle", repr(math.degrees(script.angle)),
        "--depth-mm", repr(1e3 * script.depth), "--geometry", "mesh",
        "--rhythm-s", repr(script.rhythm.period if press and script.rhythm else 0.0),
        "--record", str(folder / f"{name}.npz"), "--json-lines",
        log=folder / f"{name}.log",
    )  # fmt: skip
    client.first_line()  # the next one comes after it
    return client


def run(link: LinkSettings, seconds: float, busy: int, folder: Path, *, press: bool) -> Felt:
    """Run server, relay, clients and busy processes; return what the resting hand felt."""
    with relayed(link, busy, folder) as url:
        clients = [
            client_of(name, script, url, folder, press=press)
            for name, script in (("presses", PRESSES), ("rests", RESTS))
        ]
        time.sleep(SETTLES + seconds)
        for client in clients:
            client.let_end()
        for client in clients:
            client.wait(30.0)
    return felt_in(folder / "rests.npz", seconds)


def felt_in(recording: Path, seconds: float) -> Felt:
    """Return what a hand felt by its own recording, from `SETTLES` after its beginning."""
    columns = Recording.load(recording).columns
    kept = columns["t"] >= columns["t"][0] + SETTLES
    kept &= columns["t"] <= columns["t"][0] + SETTLES + seconds - 1.0
    force = np.sqrt(sum(columns[axis][kept] ** 2 for axis in ("fx", "fy", "fz")))
    return Felt(columns["t"][kept], force, _beyond({k: v[kept] for k, v in columns.items()}))


def _beyond(columns: dict[str, Floats]) -> float:
    """Return the largest change within 20 ms that the hand's own way does not explain [N]."""
    t = np.arange(columns["t"][0], columns["t"][-1], PERIOD)
    force, tip = (
        np.stack([np.interp(t, columns["t"], columns[key]) for key in keys], axis=1)
        for keys in (("fx", "fy", "fz"), ("x", "y", "z"))
    )
    n = round(WITHIN / PERIOD)
    change = np.linalg.norm(force[n:] - force[:-n], axis=1)
    # The way there and back counts, as do the law's spring and the damping of the passivity layer.
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))])
    stiffness = float(columns["k_h"].max()) + MAX_DAMPING / WITHIN
    return float((change - stiffness * (steps[n:] - steps[:-n])).max())


def truth() -> Floats:
    """Return the force on the resting hand without a network, in one cycle at rest, (t,) [N]."""
    body = Balloon()
    info = describe(body)
    devices = [
        SimulatedDevice(script.hand, script.intention(info.center, info.radius), INFO)
        for script in (PRESSES, RESTS)
    ]

    def mover(device: SimulatedDevice) -> Mover:
        def move(now: float, force: Vec3) -> Vec3:
            device.write(force)
            return device.read(now).position

        return move

    force = play_at_once(body, [mover(device) for device in devices], 4.0 * CYCLE).force[1]
    return np.asarray(force[-round(CYCLE / PERIOD) :])


def path(force: Floats) -> float:
    """Return the sum of all changes of a force [N]."""
    return float(np.abs(np.diff(force)).sum())


def fast(t: Floats, force: Floats) -> float:
    """Return what of a force lies above 12 Hz [N rms]."""
    b, a = butter(2, FAST * 2.0 * PERIOD, "high")
    even = np.interp(np.arange(t[0], t[-1], PERIOD), t, force)
    return float(np.std(filtfilt(b, a, even)[300:-300]))


def figures(felt: Felt) -> dict[str, float]:
    """Return what a row of the table has for any hand that pressed."""
    n = round(WITHIN / PERIOD)
    even = np.interp(np.arange(felt.t[0], felt.t[-1], PERIOD), felt.t, felt.force)
    return {
        "swing_n": float(np.ptp(felt.force)),
        "fast_n": fast(felt.t, felt.force),
        "beyond_own_n": felt.beyond,
        "in_20_ms_n": float(np.abs(even[n:] - even[:-n]).max()),
        "periods_per_s": len(felt.t) / float(felt.t[-1] - felt.t[0]),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, and print a table."""
    options_of = parser(__doc__)
    options_of.add_argument("--network", default="delay=80,jitter=40", help="words for the link")
    options_of.add_argument("--seed", type=int, default=0, help="of the link's draws")
    options_of.add_argument("--busy", type=int, default=1, help="processes that compute")
    options_of.add_argument("--plain", action="store_true", help="Python that is not compiled")
    options_of.add_argument(
        "--stalls", action="store_true", help="a hundred stalls to 1 s, at rest"
    )
    options_of.add_argument("--relay", type=int, help="relay to this port, and do nothing else")
    options = options_of.parse_args(arguments)
    link = replace(read_network(options.network), seed=options.seed)
    if options.relay:
        asyncio.run(relay(options.relay, link))
        return
    if options.plain:
        os.environ["COHAPTIC_PLAIN"] = "1"
    if options.stalls:
        link = replace(STALLS, seed=options.seed)
    rows = [measured(LinkSettings(link.delay), 0, press=not options.stalls)]
    rows.append(measured(link, options.busy, press=not options.stalls))
    tell(rows, "steady, idle")
    write(options, [{**row, "network": words_for(link)} for row in rows])


def tell(rows: Sequence[dict[str, float]], first: str) -> None:
    """Print two rows of figures beside each other."""
    print(f"{'':>14}  {first:>12}  as asked")
    for name in rows[0]:
        before, now = (row[name] for row in rows)
        print(f"{name:>14}  {before:12.4g}  {now:.4g}")


def measured(link: LinkSettings, busy: int, *, press: bool) -> dict[str, float]:
    """Return the figures of one run."""
    seconds = CYCLES * CYCLE + 1.0 if press else STALLED
    with tempfile.TemporaryDirectory() as folder:
        felt = run(link, seconds, busy, Path(folder), press=press)
    row = figures(felt)
    if press:
        true = truth()
        cycles = float(felt.t[-1] - felt.t[0]) / CYCLE
        row |= {"true_swing_n": float(np.ptp(true)), "path": path(felt.force) / path(true) / cycles}
    return row


if __name__ == "__main__":
    main()
