"""A server of a plane that follows the protocol and does no more; it notes all messages."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import (
    BodyInfo,
    ClientControl,
    Error,
    Welcome,
    decode_client_control,
    encode_control,
)
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.vec import ZERO
from tests.client.plane import PLANE

CLOCK = SystemClock()
PERIOD = 1.0 / 60.0  # s
BODY = BodyInfo(name="plane", center=ZERO, radius=0.1, contact_radius=0.02)
# In front of a hand that comes from the left.
SURFACE = replace(PLANE, x_free=(-0.1, 0.0, 0.0), normal=(-1.0, 0.0, 0.0))


def mesh_surface(mesh: RestMesh) -> Patch:
    """The plane as a mesh patch that holds all vertices."""
    n = len(mesh.vertices)
    near = Neighbourhood.of(range(n), [ZERO] * n, [SURFACE.c_ii] * n)
    return replace(SURFACE, geometry=Geometry.MESH, neighbourhood=near)


@dataclass
class Visit:
    """One connection of a client.

    Args:
        first_tick: Of the patches, which come until `ticks` of them were sent.
        ticks: After so many the server hangs up.
        refuse: Sent instead of a welcome.
        rest_mesh: Sent after the welcome; patches are then of a mesh.
        period: That the welcome names [s].
        body: The same.
        farewell: Sent after the last patch.
        close: Code and reason with which it is closed then.
        heard: All that the client said, in order.
    """

    first_tick: int = 1
    ticks: int = 1_000_000
    refuse: Error | str | None = None
    rest_mesh: RestMesh | None = None
    period: float = PERIOD
    body: BodyInfo = BODY
    farewell: Error | None = None
    close: Error | None = None
    heard: list[ClientControl | ContactSample] = field(
        default_factory=list[ClientControl | ContactSample]
    )

    @property
    def samples(self) -> list[ContactSample]:
        """The samples among the client's messages."""
        return [message for message in self.heard if isinstance(message, ContactSample)]

    async def host(self, ws: ServerConnection) -> None:
        hello = await ws.recv(decode=True)
        self.heard.append(decode_client_control(hello))
        if self.refuse is not None:
            refusal = self.refuse
            await ws.send(refusal if isinstance(refusal, str) else encode_control(refusal))
            return
        welcome = Welcome(
            user=1,
            name="left",
            simulation_period=self.period,
            to_wall=CLOCK.to_wall(),
            body=self.body,
            users=(),
        )
        await ws.send(encode_control(welcome))
        if self.rest_mesh is not None:
            await ws.send(self.rest_mesh.encode())
            # No patch without a sample, and no sample before the loop has its mesh.
            while not self.samples:
                data = await ws.recv(decode=False)
                self.heard.append(ContactSample.decode(data))
        listener = asyncio.ensure_future(self._listen(ws))
        try:
            for tick in range(self.first_tick, self.first_tick + self.ticks):
                patch = SURFACE if self.rest_mesh is None else mesh_surface(self.rest_mesh)
                patch = replace(patch, tick=tick, t_server=CLOCK.now())
                if self.samples:
                    newest = self.samples[-1]
                    patch = replace(patch, seq=newest.seq, t_client=newest.t_client)
                await ws.send(patch.encode())
                await asyncio.sleep(PERIOD)
            if self.farewell is not None:
                await ws.send(encode_control(self.farewell))
            if self.close is not None:
                await ws.close(self.close.code, self.close.message)
        finally:
            listener.cancel()

    async def _listen(self, ws: ServerConnection) -> None:
        async for data in ws:
            if isinstance(data, bytes):
                self.heard.append(ContactSample.decode(data))
            else:
                self.heard.append(decode_client_control(data))


@asynccontextmanager
async def plane_server(*visits: Visit) -> AsyncGenerator[str]:
    """The address of a server that hosts each visit in turn."""
    left = iter(visits)

    async def handle(ws: ServerConnection) -> None:
        try:
            await next(left).host(ws)
        except ConnectionClosed:
            pass

    protocols = [Subprotocol(SUBPROTOCOL)]
    async with serve(handle, "127.0.0.1", 0, subprotocols=protocols) as server:
        yield f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}"
