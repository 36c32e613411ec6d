"""Size and cost of a session file: eight people at 1 kHz, with all columns of their rows.

    python benchmarks/session_file.py [--users 8] [--minutes 10] [--sample 4] [--json FILE]

People press and slide on the balloon in virtual time for `--sample` seconds, at 60 Hz, with 10 ms
of delay, friction and models of the other hands. Their rows have the jitter of a real loop's clock,
which is most of what a column of times holds. A session of `--minutes` repeats these seconds at
later times, so that no chunk sees them twice. Given are the size for each minute of each user, the
processor's time for each second of session with and without the messages for Foxglove, what an
entry costs the one who adds it, and the time to find the outline and the entries of one second in
the middle of the file, with its index and without. What `cohaptic replay` does is given as the time
to open the file, and to go to a moment: the scenes of the stretch in which it is, and a ledger.
"""

from __future__ import annotations

import math
import os
import struct
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import json_report
from cohaptic import __version__
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.sessions.entries import (
    Joined,
    Link,
    Mesh,
    Rows,
    SessionInfo,
    Shown,
    Written,
)
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.sessions.recorder import SessionRecorder
from cohaptic.sessions.replay import Replay
from cohaptic.sessions.writer import SessionFile
from cohaptic.simulated.hand import HandScript, Rhythm
from cohaptic.status.row import COLUMNS
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.rows import row_of
from cohaptic_experiments.virtual_session import VirtualSession, VirtualUser
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.body_frames import describe

STRETCH = 4.0  # s of scenes that the page of a replay fetches at once
JUMPS = 20  # moments to which the replay goes
_SCENE_TIME, _SCENE_TIME_AT = struct.Struct("<d"), 8  # of the frame of a scene, docs/protocol.md
BATCH = 0.1  # s of rows that a client sends at once
LATE = 5e-5  # s, usual lateness of a period on a machine that does little else


@dataclass
class Hand:
    """A user whose rows and samples are noted."""

    user: VirtualUser
    session: VirtualSession
    noise: np.random.Generator
    rows: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])
    read: DeviceSample | None = None

    def watch(self) -> None:
        """Put this in the way of the device's readings and of the periods."""
        device: Any = self.user.device
        reads, notes, user = device.read, self.user._note, self.user  # pyright: ignore[reportPrivateUsage]

        def read(now: float) -> DeviceSample:
            found: DeviceSample = reads(now)
            self.read = found
            return found

        def note(output: Period) -> None:
            notes(output)
            late = abs(float(self.noise.normal(0.0, LATE)))
            assert self.read is not None
            self.rows.append(row_of(user.state, self.read, output, self.session.now + late, late))

        device.read = read
        user._note = note  # type: ignore[method-assign]  # pyright: ignore[reportPrivateUsage]


class Noted:
    """Takes the entries of a session into a list, in place of a file."""

    path, ended = Path("nowhere"), False

    def __init__(self, entries: list[Written]) -> None:
        self._entries = entries

    def add(self, entry: Written) -> None:
        """Note an entry."""
        self._entries.append(entry)

    def wake(self) -> None:
        """Nothing waits."""

    def finish(self) -> str:
        """Return a sentence."""
        return "noted"


def sampled(users: int, seconds: float) -> tuple[SessionInfo, list[Written]]:
    """The first entry of a session, and some seconds of all others, in the order of their times."""
    session = VirtualSession(Balloon())
    entries = list[Written]()
    info = SessionInfo(
        session.now, __version__, PROTOCOL_VERSION, "bench",
        describe(session.room.body).model_dump(mode="json"),
        session.room.settings.simulation_period, 1.8e9, {"body": "balloon"},
    )  # fmt: skip
    session.keep_in(Noted(entries))
    hands = list[Hand]()
    noise = np.random.default_rng(1)
    for i in range(users):
        script = HandScript(
            angle=2.0 * math.pi * i / users, depth=0.012, rhythm=Rhythm(1.0 + 0.1 * i),
            approach_at=0.1,
        )  # fmt: skip
        user = session.join(
            f"user {i}", script, delay=0.01, jitter=0.002, seed=i, friction=0.3, geometry="mesh",
            models=True,
        )  # fmt: skip
        hands.append(Hand(user, session, noise))
        hands[-1].watch()
    for step in range(round(seconds / BATCH)):
        session.run(BATCH)
        for hand in hands:
            number = hand.user.number
            block = np.array(hand.rows)
            hand.rows.clear()
            entries.append(Rows(float(block[0, 0]), number, COLUMNS, block.tobytes(), 0.0, 1e-4))
            if step % 10 == 0:
                entries.append(Link(session.now, number, 0.021, 0.001, 0.0, 1e-4))
    return info, entries


def later(entry: Written, by: float) -> Written:
    """The same entry at a later time [s], with the times and ticks within it."""
    moved: Written = replace(entry, t=entry.t + by)
    if isinstance(moved, Rows):
        table = np.frombuffer(moved.block).reshape(-1, len(moved.columns)).copy()
        table[:, 0] += by
        moved = replace(moved, block=table.tobytes())
    if isinstance(moved, Shown):
        frame = bytearray(moved.frame)
        _SCENE_TIME.pack_into(frame, _SCENE_TIME_AT, moved.t)
        moved = replace(moved, frame=bytes(frame))
    return moved


def repeated(entries: list[Written], sample: float, seconds: float) -> Iterator[list[Written]]:
    """A session of so many seconds, in lists of one sample each."""
    for i in range(round(seconds / sample)):
        chosen = entries if i == 0 else [e for e in entries if not isinstance(e, Joined | Mesh)]
        yield [later(entry, i * sample) for entry in chosen]


def main() -> None:
    """Print the figures."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--users", type=int, default=8)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--sample", type=float, default=4.0, help="seconds that are simulated")
    options = parser.parse_args()
    info, entries = sampled(options.users, options.sample)
    seconds = 60.0 * options.minutes
    results: list[json_report.Result] = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "session.mcap"
        for plots in (False, True):
            path.unlink(missing_ok=True)
            row = _write(path, info, entries, options.sample, seconds, plots=plots)
            row |= {
                "mb_per_user_minute": path.stat().st_size / 1e6 / options.users / options.minutes
            }
            results.append({"plots": plots, "users": options.users, **row})
            print("; ".join(f"{name} {value:.4g}" for name, value in row.items()), f"plots {plots}")
        middle = info.t + 0.5 * seconds
        results += [_seek(path, middle, "with its index"), _replay(path, "with its index")]
        os.truncate(path, path.stat().st_size - 1000)
        results += [_seek(path, middle, "without an index"), _replay(path, "without an index")]
    results.append(_add(info, entries, options.sample))
    json_report.write(options, results)


def _write(
    path: Path, info: SessionInfo, entries: list[Written], sample: float, seconds: float, *,
    plots: bool,
) -> dict[str, float]:  # fmt: skip
    file = SessionFile("--path", path, info, plots=plots)
    spent, count = 0.0, 0
    for part in repeated(entries, sample, seconds):
        start = time.process_time()
        for entry in part:
            file.add(entry)
        spent += time.process_time() - start
        count += len(part)
    start = time.process_time()
    file.close()
    spent += time.process_time() - start
    return {"cpu_per_second": spent / seconds, "entries_per_second": count / seconds}


def _seek(path: Path, t: float, words: str) -> json_report.Result:
    start = time.perf_counter()
    outline = Outline.of(path)
    glance = time.perf_counter() - start
    start = time.perf_counter()
    first = next(read_entries(path, t))
    found = time.perf_counter() - start
    start = time.perf_counter()
    count = sum(1 for _ in read_entries(path, t, t + 1.0))
    second = time.perf_counter() - start
    print(
        f"{words}: outline of {outline.seconds:.0f} s in {glance:.3f} s; first entry at"
        f" {first.t:.3f} s after {found:.3f} s; the {count} entries of one second after"
        f" {second:.3f} s"
    )
    return {"seek": words, "outline_s": glance, "first_s": found, "second_s": second}


def _replay(path: Path, words: str) -> json_report.Result:
    """What a page of a replay waits for: at first, and at moments all over the session."""
    start = time.perf_counter()
    opened = Replay.of(path)
    first = time.perf_counter() - start
    seeks, ledgers = list[float](), list[float]()
    for t in np.linspace(opened.first, opened.last - STRETCH, JUMPS).tolist():
        start = time.perf_counter()
        opened.scenes(t, t + STRETCH)
        seeks.append(time.perf_counter() - start)
        start = time.perf_counter()
        opened.why(1, t + 1.0)
        ledgers.append(time.perf_counter() - start)
    print(
        f"{words}: a replay opens in {first:.3f} s, has a stretch of {STRETCH:g} s in at most"
        f" {max(seeks):.3f} s, and a ledger in {max(ledgers):.3f} s"
    )
    return {
        "replay": words, "open_s": first, "stretch_s": max(seeks), "why_s": max(ledgers)
    }  # fmt: skip


def _add(info: SessionInfo, entries: list[Written], sample: float) -> json_report.Result:
    """What an entry costs its caller, at the pace of a session: a tenth of a second at once."""
    costs = list[float]()
    with tempfile.TemporaryDirectory() as folder:
        recorder = SessionRecorder(Path(folder) / "x.mcap", info, tell=print)
        for start in np.arange(info.t, info.t + sample, BATCH).tolist():
            part = [entry for entry in entries if start <= entry.t < start + BATCH]
            began = time.thread_time()
            for entry in part:
                recorder.add(entry)
            costs.append((time.thread_time() - began) / max(1, len(part)))
            time.sleep(0.5 * BATCH)
        recorder.finish()
    cost = sorted(costs)[len(costs) // 2]
    print(f"adding an entry takes {1e6 * cost:.2f} us")
    return {"add_s": cost}


if __name__ == "__main__":
    main()
