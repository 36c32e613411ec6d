"""One client, put together: session, link, haptic process. The shell that decides nothing.

The haptic process starts with the first welcome and outlives a lost connection: the force fades by
itself when patches stop, and comes back when they do.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from cohaptic.clock import SystemClock
from cohaptic.errors import CloseCode, CohapticError, RemoteProtocolError, ServerLost
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import BodyInfo, Hello, UserJoined, UserLeft, Welcome
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.status.report import TouchStatus
from cohaptic.status.row import Row
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.loop.config import LoopConfig, haptic_period, law_settings, silent_after
from cohaptic_client.loop.handle import HapticProcess, TipSample
from cohaptic_client.loop.memory import SharedMemory
from cohaptic_client.loop.passivity import device_damping_limit
from cohaptic_client.loop.safety import SafetyLimits, rate_of
from cohaptic_client.network.link import Data, Link
from cohaptic_client.network.pacing import Pacer
from cohaptic_client.network.session import ClientSession
from cohaptic_client.network.timing import LinkTiming
from cohaptic_client.settings import ClientSettings

HEARTBEAT = 0.1  # s
RETRY = 0.5  # s between attempts to reach a server


class Refused(CohapticError):
    """The server said why this client may not take part.

    Args:
        code: Of `CloseCode`.
        reason: In the server's words.
    """

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason

    def __str__(self) -> str:
        return f"the server refused: {self.reason}"


class Client:
    """One user at one server.

    Args:
        settings: Of the client.
        tell: Called with each piece of news for people.
        keep: Called with what the loop did in each period, some at a time.
    """

    def __init__(
        self,
        settings: ClientSettings,
        *,
        tell: Callable[[str], None],
        keep: Callable[[list[Row]], None],
    ) -> None:
        self.settings = settings
        self.clock = SystemClock()
        self._tell, self._keep = tell, keep
        self._memory = SharedMemory.create()
        self._haptics: HapticProcess | None = None
        self._link: Link | None = None
        self._pacer: Pacer | None = None
        self._seq = 0
        self._timing = LinkTiming()
        self._server_to_wall = 0.0
        self._begun_for: tuple[BodyInfo, float] | None = None
        self._row: Row | None = None
        self._limits: SafetyLimits | None = None
        self._welcome: Welcome | None = None
        self._mesh_file = Path(f"{self._memory.path}.mesh")
        self._mesh: RestMesh | None = None

    async def run(self) -> None:
        """Touch until cancelled, the duration is over, or the server is lost for good.

        Raises:
            ServerLost: No server within the settings' patience.
            Refused: The server refused this client.
            DeviceError: The device cannot be had, or went away.
        """
        work = [asyncio.ensure_future(self._beat()), asyncio.ensure_future(self._connect())]
        try:
            done, _ = await asyncio.wait(
                work, timeout=self.settings.duration, return_when=asyncio.FIRST_COMPLETED
            )
            for task in done:
                task.result()
        finally:
            # The force fades while the link still carries it to the server.
            await self._let_go()
            for task in work:
                task.cancel()
            await asyncio.gather(*work, return_exceptions=True)
            self._memory.close(remove=True)
            self._mesh_file.unlink(missing_ok=True)

    def status(self) -> TouchStatus:
        """What this client can say of itself now."""
        loop, row = self._loop_status(), self._row
        if row is None:
            return TouchStatus(name=self.settings.name, state="connecting")
        return TouchStatus(
            name=self.settings.name,
            state=self._state_in_words(row),
            force=math.hypot(row.fx, row.fy, row.fz),
            felt_from_others=row.scale * row.felt_from_others,
            indentation=row.indentation,
            k_o=row.k_o,
            k_h=row.k_h,
            lag=row.lag,
            max_stiffness=device_info(self.settings.device).max_stiffness,
            along=row.along if self.settings.friction > 0.0 else None,
            law=self.settings.law.value,
            round_trip=self._timing.round_trip,
            jitter=self._timing.jitter,
            clock_offset=self._clock_offset(),
            clock_error=self._timing.clock_error,
            loop_hz=float(loop.get("loop_hz", 0.0)),
            loop_late_p99=float(loop.get("late_p99", 0.0)),
            loop_missed=int(loop.get("missed", 0)),
            level=row.level,
            fault=str(loop.get("fault", "")),
        )

    def _clock_offset(self) -> float:
        """Server's wall clock less this machine's [s]; 0 before the first patch."""
        if self._timing.best is None:
            return 0.0
        return self._timing.clock_offset + self._server_to_wall - self.clock.to_wall()

    def _state_in_words(self, row: Row) -> str:
        if self._haptics is not None and self._haptics.stopping:
            return "stopped"
        if row.tick == 0:
            return "connecting"
        # On a link that jitters the loop waits for longer (`step._is_silent`).
        silent = self._limits is not None and row.patch_age > self._limits.silent_after
        if silent and row.scale < 1.0:
            return "server silent"
        if row.scale == 0.0:
            return "waiting"
        return "touching" if row.wanted > 0.0 else "free"

    def _loop_status(self) -> dict[str, Any]:
        return self._haptics.status if self._haptics is not None else {}

    async def _beat(self) -> None:
        """Keep the loop's process informed, and empty its ring of rows."""
        told = ""
        while True:
            await asyncio.sleep(HEARTBEAT)
            if self._haptics is None:
                continue
            self._haptics.beat()
            self._collect()
            fault = str(self._haptics.status.get("fault", ""))
            if fault and fault != told:
                self._tell(f"force off: {fault}; lift off the object to go on")
            told = fault

    def _collect(self) -> None:
        assert self._haptics is not None
        rows = self._haptics.new_rows()
        if rows:
            self._row = rows[-1]
            self._keep(rows)

    async def _connect(self) -> None:
        """Connect, and connect again, while patience lasts."""
        patience = self.settings.patience
        until = self.clock.now() + patience
        error: CohapticError
        while True:
            try:
                reason = await self._converse()
                until = self.clock.now() + patience
                error = ServerLost(self.settings.url, reason)
            except ServerLost as lost:
                error = lost
            except Refused as refused:
                # After a broken connection the server may not know yet that it is broken.
                ours = refused.code == CloseCode.NAME_TAKEN.value and self._haptics is not None
                if not ours:
                    raise
                error = refused
            if self.clock.now() >= until:
                raise error
            self._tell(f"{error}; trying again for {until - self.clock.now():.0f} s")
            await asyncio.sleep(RETRY)

    async def _converse(self) -> str:
        """One connection, to its end; returns why it ended."""
        settings, session = self.settings, ClientSession()
        link = Link(settings.url, self.clock, settings.up, settings.down)
        await link.open()
        try:
            device = device_info(settings.device)
            hello = Hello(
                protocol=PROTOCOL_VERSION,
                name=settings.name,
                law=settings.law,
                max_stiffness=device.max_stiffness,
                max_force=self._max_force(device),
                damping_budget=self._max_damping(device),
                geometry=settings.geometry,
                friction=settings.friction > 0.0,
                fixed_gains=settings.fixed_gains,
            )
            link.send(session.greeting(hello))
            self._seq, self._pacer, self._link = 0, None, link
            self._timing = LinkTiming()  # another server may have another clock
            sender = asyncio.ensure_future(self._send(link))
            listener = asyncio.ensure_future(link.receive(lambda data: self._hear(session, data)))
            try:
                # The sender ends only by an exception, which is then this client's end.
                await asyncio.wait({sender, listener}, return_when=asyncio.FIRST_COMPLETED)
                if sender.done():
                    sender.result()
                return await listener
            finally:
                sender.cancel()
                listener.cancel()
        finally:
            self._link = None
            await link.close()

    def _hear(self, session: ClientSession, data: Data) -> None:
        """One message from the server, after its injected delay."""
        event = session.receive(data)
        if isinstance(event, Patch):
            assert isinstance(data, bytes)
            if self._haptics is None:
                raise RemoteProtocolError(
                    "message", "Patch", "a rest mesh, then samples, before it"
                )
            self._haptics.give_patch(data)
            self._time(event)
        elif isinstance(event, Welcome):
            self._welcome = event
            if self.settings.geometry != "mesh":
                self._begin(event)
        elif isinstance(event, RestMesh):
            self._keep_mesh(event, data)
        elif isinstance(event, UserJoined):
            self._tell(f"{event.name} joined")
        elif isinstance(event, UserLeft):
            self._tell(f"{event.name} left: {event.reason}")
        else:
            raise Refused(event.code, event.message)

    def _time(self, patch: Patch) -> None:
        """Learn from a patch how long the way there and back is, and when to send."""
        if patch.seq == 0 or self._pacer is None:
            return
        self._pacer = self._pacer.reported(patch.t_client, patch.sample_wait)
        self._timing = self._timing.measured(
            t_client=patch.t_client,
            t_server=patch.t_server,
            sample_wait=patch.sample_wait,
            now=self.clock.now(),
        )

    def _keep_mesh(self, mesh: RestMesh, data: Data) -> None:
        """Give the resting mesh to the loop, which starts with it."""
        if self._mesh not in (None, mesh):
            # A loop that runs has the old one.
            raise RemoteProtocolError(
                "rest mesh", "another body's", "the one of before: start anew"
            )
        if self._welcome is None or self.settings.geometry != "mesh":
            raise RemoteProtocolError("message", "RestMesh", "none: this client did not ask for it")
        if self._mesh is None:
            assert isinstance(data, bytes)
            self._mesh_file.write_bytes(data)
            self._mesh = mesh
        self._begin(self._welcome)

    def _begin(self, welcome: Welcome) -> None:
        """The server took us in: start the loop, if it does not run yet, and the schedule."""
        others = ", ".join(welcome.users) or "nobody else"
        self._tell(f"touching {welcome.body.name} with {others}")
        self._server_to_wall = welcome.to_wall
        self._pacer = Pacer(welcome.simulation_period, self.clock.now())
        found = (welcome.body, welcome.simulation_period)
        if self._haptics is not None:
            if found != self._begun_for:
                # A loop that runs was made for the old one.
                what = f"{welcome.body.name} at {1.0 / welcome.simulation_period:.4g} Hz"
                limit = "the body and rate from before: start anew"
                raise RemoteProtocolError("what the server has now", what, limit)
            return
        self._begun_for = found
        settings = self.settings
        device = device_info(settings.device)
        self._limits = SafetyLimits(
            max_force=self._max_force(device),
            max_rate=rate_of(device.max_stiffness),
            stall=device.stall,
            silent_after=silent_after(welcome.simulation_period),
            period=haptic_period(settings.loop_hz),
        )
        config = LoopConfig(
            memory=self._memory.path,
            clock_origin=self.clock.origin,
            haptic_period=haptic_period(settings.loop_hz),
            simulation_period=welcome.simulation_period,
            law=law_settings(settings.thresholds, welcome.simulation_period, self._limits),
            smoothing=settings.smoothing,
            friction=settings.friction,
            follow=settings.fixed_gains is None,
            max_damping=self._max_damping(device),
            device=DeviceConfig(
                settings.device,
                welcome.body.center,
                welcome.body.radius,
                settings.script.hand,
                settings.script.intention(welcome.body.center, welcome.body.radius),
            ),
            rest_mesh=str(self._mesh_file) if self._mesh is not None else None,
            limits=self._limits,
        )
        self._haptics = HapticProcess(config, self._memory)

    def _max_damping(self, device: DeviceInfo) -> float:
        """What the passivity layer may damp on this device, by Colgate's bound [N s/m]."""
        if not self.settings.passivity:
            return 0.0
        period = haptic_period(self.settings.loop_hz)
        return device_damping_limit(device.damping, device.max_stiffness, period)

    def _max_force(self, device: DeviceInfo) -> float:
        """What the hand, or the body under a device that only senses, may get [N]."""
        return min(self.settings.max_force, device.max_force or self.settings.max_force)

    async def _send(self, link: Link) -> None:
        """Send the newest sample once per simulation period, timed by the pacer."""
        while True:
            wait = HEARTBEAT if self._pacer is None else self._pacer.due - self.clock.now()
            await asyncio.sleep(max(0.0, wait))
            if self._pacer is None or self._haptics is None:
                continue
            if self._pacer.due > self.clock.now():
                continue  # moved by a report in the meantime
            self._pacer = self._pacer.sent(self.clock.now())
            tip = self._haptics.newest_sample()
            if tip is not None:
                self._send_sample(link, tip)

    def _send_sample(self, link: Link, tip: TipSample) -> None:
        self._seq += 1
        sample = ContactSample(self._seq, tip.tick, tip.t, tip.probe, tip.force)
        link.send(sample.encode())

    async def _let_go(self) -> None:
        """Fade the force, send a last sample without any, say goodbye."""
        if self._haptics is None:
            return
        self._haptics.request_stop()
        await asyncio.to_thread(self._haptics.wait)
        self._collect()
        # Nothing of the schedule goes out behind the farewell.
        self._pacer = None
        link, tip = self._link, self._haptics.newest_sample()
        if link is None:
            return
        if tip is not None:
            self._send_sample(link, replace(tip, force=ZERO))
        link.send(ClientSession.farewell())
        # What was said is still on its way through the injected delay.
        await asyncio.sleep(self.settings.up.delay + self.settings.up.jitter + HEARTBEAT)
