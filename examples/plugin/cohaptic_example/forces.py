"""A route: programs of the lab read how hard each hand presses, twenty times a second.

A program connects as a websocket with the subprotocol `example-forces.1`, and is sent a JSON
object for each reading: `{"tick": 812, "forces": {"ada": 1.93}}`, forces in newtons. The text of
the option is how many programs may read at once.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from websockets.asyncio.server import ServerConnection

from cohaptic import SettingError
from cohaptic_server import CohapticServer, Endpoint, Route, Serving

SUBPROTOCOL = "example-forces.1"
PERIOD = 0.05  # s
READERS = 4


def reading(server: CohapticServer) -> str:
    """The forces of this moment."""
    room = server.room  # asked for each time: with another object there is another room
    users = room.world.users
    forces = {
        member.hello.name: float(users.applied.force[users.rows[number]])
        for number, member in room.members.items()
        if number in users.rows
    }
    return json.dumps({"tick": room.world.tick, "forces": forces})


def max_readers(text: str) -> int:
    """The number of programs that may read at once, from the text of the option."""
    if not text:
        return READERS
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= 100):
        raise SettingError("--route forces", repr(text[:20]), "a number from 1 to 100")
    return int(text)


@asynccontextmanager
async def offer(serving: Serving, text: str) -> AsyncGenerator[str]:
    """Let programs of this machine read the forces while the server runs."""
    limit, readers = max_readers(text), 0

    async def serve(connection: ServerConnection) -> None:
        nonlocal readers
        if readers >= limit:
            await connection.close(1013, f"as many as may, {limit}, read already")
            return
        readers += 1
        try:
            while True:
                # This waits for one program alone. To one that is slow the newest go late, and
                # some are left out.
                await connection.send(reading(serving.server))
                await asyncio.sleep(PERIOD)
        finally:
            readers -= 1

    serving.server.add_endpoint(SUBPROTOCOL, Endpoint(serve, longest=64))
    yield f"programs of this machine may read forces, as {SUBPROTOCOL}; at once: {limit}"


ROUTE = Route(offer, check=max_readers)
