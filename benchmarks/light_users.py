"""Users whose haptic loops run elsewhere: their connections to a server, without any loop.

    python benchmarks/light_users.py URL USERS [--geometry mesh] [--speed 0]

Each presses on the top of a ring (`soft_ring.py`) up to 8 mm deep and lets go again, every two
seconds, and sends the force of the newest patch, 60 times a second, over a websocket of its own.
With `--speed`, each slides along the ring without pause instead, 4 mm deep and all in the same
direction. All in one process, which costs a tenth of a core. They ask for mesh patches, as clients
do, unless told otherwise. Prints `here` once every user has a patch.
"""

from __future__ import annotations

import argparse
import asyncio
import math
from collections.abc import Awaitable, Callable

from pydantic import TypeAdapter
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import GeometryName, Hello, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import MAX_BYTES
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.vec import Vec3, dot, scale, sub
from cohaptic_server.testing.soft_ring import RING, TUBE

PERIOD = 1.0 / 60.0  # s
DEPTH, RHYTHM = 0.008, 2.0  # m, s


async def converse(
    url: str,
    hello: Hello,
    hear: Callable[[str | bytes], None],
    play: Callable[[ClientConnection], Awaitable[None]],
) -> None:
    """Join a room, and send until the connection closes.

    Args:
        hear: Takes each message of the server, from the welcome on; of frames only patches.
        play: Sends what the user does.
    """
    protocols = [Subprotocol(SUBPROTOCOL)]
    async with connect(
        url, subprotocols=protocols, proxy=None, max_size=MAX_BYTES, compression=None
    ) as ws:
        await ws.send(encode_control(hello))
        hear(await ws.recv())
        if hello.geometry == "mesh":
            await ws.recv()  # the resting mesh, which is not needed

        async def listen() -> None:
            async for data in ws:
                hear(data)

        hearing = asyncio.create_task(listen())
        try:
            await play(ws)
        except ConnectionClosed:
            pass
        finally:
            hearing.cancel()


class User:
    """One user.

    Args:
        number: Number of this user, from 0.
        count: Number of all users.
        geometry: Geometry of its patches.
        speed: Along the ring [m/s]; 0 to press in place.
    """

    def __init__(self, number: int, count: int, geometry: GeometryName, speed: float) -> None:
        self.geometry: GeometryName = geometry
        self.number, self.angle = number, 2.0 * math.pi * number / count
        self.speed = speed
        self.patch: Patch | None = None

    async def run(self, url: str) -> None:
        """Press until the connection closes."""
        name = f"light{self.number}"
        hello = Hello(protocol=PROTOCOL_VERSION, name=name, geometry=self.geometry)
        await converse(url, hello, self._hear, self._press)

    def _hear(self, data: str | bytes) -> None:
        if isinstance(data, bytes):
            self.patch = Patch.decode(data)

    async def _press(self, ws: ClientConnection) -> None:
        loop = asyncio.get_running_loop()
        start, seq = loop.time(), 0
        while True:
            seq += 1
            t = loop.time() - start
            probe = self._probe(t)
            await ws.send(ContactSample(seq, self._tick(), t, probe, self._force(probe)).encode())
            await asyncio.sleep(max(0.0, start + seq * PERIOD - loop.time()))

    def _probe(self, t: float) -> Vec3:
        """Where the tip is at the time `t` [s], whatever the force [m]."""
        angle = self.angle + self.speed * t / RING
        level = 0.5
        if not self.speed:
            level -= 0.5 * math.cos(2.0 * math.pi * (t / RHYTHM + 0.13 * self.number))
        return (RING * math.cos(angle), RING * math.sin(angle), TUBE - DEPTH * level)

    def _tick(self) -> int:
        return 0 if self.patch is None else self.patch.tick

    def _force(self, probe: Vec3) -> Vec3:
        if self.patch is None:
            return (0.0, 0.0, 0.0)
        depth = dot(sub(self.patch.x_free, probe), self.patch.normal)
        return scale(self.patch.normal, min(9.0, max(0.0, self.patch.k_h * depth)))


async def play(url: str, count: int, geometry: GeometryName, speed: float) -> None:
    """Run all users."""
    users = [User(number, count, geometry, speed) for number in range(count)]
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
    parser.add_argument("--geometry", default="mesh")
    parser.add_argument("--speed", type=float, default=0.0, help="of sliding, in m/s; 0 to press")
    args = parser.parse_args()
    geometry = TypeAdapter[GeometryName](GeometryName).validate_python(args.geometry)
    asyncio.run(play(args.url, args.users, geometry, args.speed))


if __name__ == "__main__":
    main()
