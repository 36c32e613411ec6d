"""Users whose haptic loops run elsewhere, and who send their rows to a server that records.

    python benchmarks/row_users.py URL USERS

Each plays four seconds of a hand that presses a balloon, over and over: the samples, the rows of a
loop at 1 kHz and the noise of its timing are those of real loops in virtual time, made before
(`session_file.py`). A sample goes 60 times a second, and the rows of that time behind it while the
session is recorded, as a client does it. All in one process. Prints `here` once every user has a
patch.
"""

from __future__ import annotations

import argparse
import asyncio
from dataclasses import dataclass, field

import numpy as np
from websockets.asyncio.client import ClientConnection

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Hello, Recorded, decode_server_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.sessions.codec import table_of
from cohaptic.sessions.entries import Heard, Rows, Written
from cohaptic.status.row_batch import Clock
from cohaptic_client.loop.rows_out import RowsOut
from light_users import PERIOD, converse
from session_file import sampled

SECONDS = 4.0  # of a press, played over and over


@dataclass
class Played:
    """What one hand does.

    Args:
        samples: One for each sixtieth of a second.
        rows: Shape (4000, columns); `t` begins at 0.
    """

    samples: list[ContactSample]
    rows: np.ndarray[tuple[int, int], np.dtype[np.float64]]

    @classmethod
    def of(cls, entries: list[Written], user: int) -> Played:
        """Return what a user does in the entries of a session."""
        heard = [e for e in entries if isinstance(e, Heard) and e.user == user]
        blocks = [table_of(e) for e in entries if isinstance(e, Rows) and e.user == user]
        rows = np.concatenate(blocks)
        rows[:, 0] -= rows[0, 0]
        return cls([ContactSample.decode(entry.frame) for entry in heard], rows)


@dataclass
class User:
    """One user at a server.

    Attributes:
        patch: Newest patch; None before the first.
        recorded: Whether the server records.
    """

    number: int
    played: Played
    out: RowsOut = field(default_factory=RowsOut)
    patch: Patch | None = None
    recorded: bool = False

    async def run(self, url: str) -> None:
        """Play until the connection closes."""
        name = f"user{self.number}"
        hello = Hello(protocol=PROTOCOL_VERSION, name=name, friction=True, models=True)
        await converse(url, hello, self._hear, self._play)

    def _hear(self, data: str | bytes) -> None:
        if isinstance(data, bytes):
            self.patch = Patch.decode(data)
        elif isinstance(news := decode_server_control(data), Recorded):
            self.recorded = news.on

    async def _play(self, ws: ClientConnection) -> None:
        loop = asyncio.get_running_loop()
        start, seq, sent = loop.time() + 0.002 * self.number, 0, 0
        while True:
            await asyncio.sleep(max(0.0, start + seq * PERIOD - loop.time()))
            now = loop.time()
            sample = self.played.samples[seq % len(self.played.samples)]
            seq += 1
            tick = 0 if self.patch is None else self.patch.tick
            await ws.send(sample._replace(seq=seq, tick=tick, t_client=now).encode())
            made = int(1000.0 * (now - start))
            if self.recorded and self.patch is not None:
                self.out.keep(self._rows(start, sent, made))
                to_server = self.patch.t_server + self.patch.sample_wait - self.patch.t_client
                clock = Clock(to_server, 0.001, 0.004, 0.0005)
                for frame in self.out.batches(clock, whole=True):
                    await ws.send(frame)
            sent = made

    def _rows(self, start: float, first: int, end: int) -> bytes:
        rows = self.played.rows
        places = np.arange(first, end)
        block = rows[places % len(rows)]
        block[:, 0] = start + 1e-3 * places
        return block.tobytes()


async def play(url: str, count: int) -> None:
    """Run all users."""
    _, entries = sampled(count, SECONDS)
    users = [User(i, Played.of(entries, i + 1)) for i in range(count)]
    running = [asyncio.create_task(user.run(url)) for user in users]
    while any(user.patch is None for user in users):
        await asyncio.sleep(0.1)
    print("here", flush=True)
    await asyncio.gather(*running)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("users", type=int)
    args = parser.parse_args()
    asyncio.run(play(args.url, args.users))


if __name__ == "__main__":
    main()
