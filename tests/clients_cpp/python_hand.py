"""A hand in Python whose tip is where a script says, with the loop of `cohaptic touch`."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import BodyInfo, Error, Hello, Welcome
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.config import silent_after
from cohaptic_client.loop.safety import SafetyLimits
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from cohaptic_client.network.session import ClientSession
from cohaptic_client.network.timing import Pacer

PERIOD = 0.001  # s
MAX_STIFFNESS = 1000.0  # N/m


class PythonHand:
    """One hand in one room.

    Args:
        url: Of the server.
        name: By which it joins.
        tip: Where its tip is, for a body and a time since the welcome [s].

    Attributes:
        force: On the hand in the newest period [N].
    """

    def __init__(self, url: str, name: str, tip: Callable[[BodyInfo, float], Vec3]) -> None:
        self._url, self._name, self._tip = url, name, tip
        self._clock = SystemClock()
        self._session = ClientSession((Law.PREDICTIVE,))
        self._state, self._settings = LoopState(), LoopSettings(1.0 / 60.0, SafetyLimits())
        self._pacer = Pacer(1.0, 0.0)
        self.force: Vec3 = ZERO

    async def run(self) -> None:
        """Touch until cancelled."""
        protocols = [Subprotocol(SUBPROTOCOL)]
        async with connect(self._url, subprotocols=protocols, compression=None) as socket:
            hello = Hello(
                protocol=PROTOCOL_VERSION, name=self._name, max_stiffness=MAX_STIFFNESS,
                geometry="plane",
            )  # fmt: skip
            await socket.send(self._session.greeting(hello))
            welcome = self._session.receive(await socket.recv())
            assert isinstance(welcome, Welcome), welcome
            period = welcome.simulation_period
            limits = SafetyLimits(silent_after=silent_after(period), stall=1.0)
            self._settings = LoopSettings(period, limits, max_stiffness=MAX_STIFFNESS)
            self._pacer = Pacer(period, self._clock.now())
            async with asyncio.TaskGroup() as both:
                both.create_task(self._listen(socket))
                both.create_task(self._touch(socket, welcome.body))

    async def _listen(self, socket: ClientConnection) -> None:
        async for data in socket:
            event = self._session.receive(data)
            assert not isinstance(event, Error), event
            if isinstance(event, Patch):
                now = self._clock.now()
                self._state = receive(self._state, event, now, self._settings)
                if event.seq:
                    self._pacer = self._pacer.reported(event.t_client, event.sample_wait)

    async def _touch(self, socket: ClientConnection, body: BodyInfo) -> None:
        start, seq = self._clock.now(), 0
        while True:
            now = self._clock.now()
            sample = DeviceSample(self._tip(body, now - start), ZERO)
            self._state, period = step(self._state, sample, now, self._settings)
            self.force = period.force
            if self._pacer.due <= now:
                self._pacer = self._pacer.sent(now)
                seq += 1
                tick = 0 if self._state.patch is None else self._state.patch.tick
                frame = ContactSample(seq, tick, now, sample.position, period.on_body).encode()
                await socket.send(frame)
            await asyncio.sleep(PERIOD)
