"""The two paths that are walked most: a contact sample to a patch, and a file to a body."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncGenerator
from pathlib import Path
from typing import Any

import trimesh
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.vec import Vec3
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer
from count.crossing import Crossing, crossing

_WARM = 30  # patches until both hands press and everything was imported
_LATER = 3  # patches after a sample, of which the last one surely shows it
_PROBES: tuple[Vec3, Vec3] = ((0.09, 0.0, 0.0), (0.0, 0.09, 0.0))  # m, 10 mm deep


def of_a_sample() -> Crossing:
    """From the server's socket, with a sample of one user, to the patch of another."""
    return asyncio.run(_of_a_sample())


async def _of_a_sample() -> Crossing:
    body = Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))
    server = CohapticServer(body, ServerSettings(port=0))
    url = await server.start()
    ticking = asyncio.create_task(server.run())
    try:
        async with _user(url, "one") as one, _user(url, "two") as two:
            for seq in range(1, _WARM):
                for ws, probe in zip((one, two), _PROBES, strict=True):
                    await ws.send(_sample(seq, probe))
                    await _patch(ws)
            reported = _sample(_WARM, _PROBES[0])
            await _drained(two)
            with crossing() as found:
                await one.send(reported)
                for _ in range(_LATER):
                    await _patch(two)
    finally:
        ticking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await ticking
    return found


def of_a_file(folder: Path) -> Crossing:
    """From `build`, with a sphere in an STL file that nobody has prepared, to a body.

    Args:
        folder: Empty, for the file.
    """
    path = folder / "sphere.stl"
    creation: Any = trimesh.creation
    creation.icosphere(subdivisions=2, radius=0.05).export(path)
    source = ObjectFile(path, "z <= 20%", edge=0.2)
    with crossing() as found:
        build(source)
    return found


@contextlib.asynccontextmanager
async def _user(url: str, name: str) -> AsyncGenerator[ClientConnection]:
    protocols = [Subprotocol(SUBPROTOCOL)]
    async with connect(url, subprotocols=protocols, compression=None, proxy=None) as ws:
        await ws.send(encode_control(Hello(protocol=PROTOCOL_VERSION, name=name)))
        yield ws


def _sample(seq: int, probe: Vec3) -> bytes:
    return ContactSample(seq, 0, 0.0, probe, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)).encode()


async def _drained(ws: ClientConnection) -> None:
    """Take what has arrived, so that the next message is one that is still to be made."""
    with contextlib.suppress(TimeoutError):
        while True:
            await asyncio.wait_for(ws.recv(), 1e-3)


async def _patch(ws: ClientConnection) -> None:
    while not isinstance(await ws.recv(), bytes):
        pass
