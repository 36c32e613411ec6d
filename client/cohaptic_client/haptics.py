"""The haptic side of a client: it starts, feeds and ends the process of the haptic loop.

The process starts after the server's first welcome message. It outlives a lost connection: the
force fades when no patches come any more, and rises again when patches return.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

from cohaptic.clock import SystemClock
from cohaptic.errors import AnotherObject, DeviceError, RemoteProtocolError
from cohaptic.protocol.messages import BodyInfo, Welcome
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.simulated.cast import cast
from cohaptic.status.row import Row, last_row
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.devices.kind import DeviceConfig
from cohaptic_client.devices.scripted import TARGET
from cohaptic_client.loop.config import LoopConfig, haptic_period, law_settings, silent_after
from cohaptic_client.loop.handle import HapticProcess, TipSample
from cohaptic_client.loop.memory import MESH_SUFFIX, LoopMemory, remove_killed
from cohaptic_client.loop.rows_out import RowsOut
from cohaptic_client.loop.safety import Mode, SafetyLimits, rate_of
from cohaptic_client.settings import ClientSettings


class Haptics:
    """The haptic loop's process, and the memory that the network process shares with it.

    Args:
        clock: Clock of this process; the loop reads the same time.
        keep: Function that records the rows since the last call, as a block for
            `cohaptic.status.row.rows_in`; None if the rows of all periods are not needed.
        passed: Device and rules of a script, as the loop's process receives them; empty for none.
        fault: Fault of an earlier loop that the user has not acknowledged; empty for none.

    Raises:
        DeviceError: There is no room for the shared memory.

    Attributes:
        row: Newest row of the loop; None before the first.
        rows_out: Rows for a server that records the session; None while none does.
        silent_after: Time without a patch after which the loop counts the server as silent [s];
            None before the start.
    """

    def __init__(
        self,
        settings: ClientSettings,
        clock: SystemClock,
        keep: Callable[[bytes], None] | None,
        fault: str = "",
        passed: bytes = b"",
    ) -> None:
        self.row: Row | None = None
        self.rows_out: RowsOut | None = None
        self.silent_after: float | None = None
        self._settings = settings
        self._clock = clock
        self._keep = keep
        self._fault = fault
        self._passed = passed
        remove_killed(clock.now() + clock.to_wall())
        with _room(settings.device.name):
            self._memory = LoopMemory.create()
        self._mesh_file = Path(f"{self._memory.path}{MESH_SUFFIX}")
        self._mesh: RestMesh | None = None
        self._welcome: Welcome | None = None
        self._process: HapticProcess | None = None
        self._faults: object = 0

    @property
    def running(self) -> bool:
        """Whether `start` has started the loop."""
        return self._process is not None

    @property
    def body(self) -> BodyInfo | None:
        """Body that the loop touches; None before the server has admitted this client."""
        return None if self._welcome is None else self._welcome.body

    @property
    def simulation_period(self) -> float:
        """Time between the server's ticks [s]; 0 before the server has admitted this client."""
        return 0.0 if self._welcome is None else self._welcome.simulation_period

    @property
    def stopping(self) -> bool:
        """Whether this process has told the loop to end."""
        return self._process is not None and self._process.stopping

    @property
    def status(self) -> dict[str, Any]:
        """Newest report of the loop; empty before the first."""
        return self._process.status if self._process is not None else {}

    @property
    def holds_fault(self) -> bool:
        """Whether a fault keeps the force off until the user acknowledges the fault."""
        return self.status.get("mode") == Mode.FAULT.value

    async def anew(self) -> Haptics:
        """Fade the force and end the loop; return a new `Haptics` object, which has no body yet.

        A fault that the user has not acknowledged keeps the force off in the new loop, too.
        """
        await self.stop()
        self.close()
        fault = str(self.status.get("fault", "")) if self.holds_fault else self._fault
        return Haptics(self._settings, self._clock, self._keep, fault, self._passed)

    def keep_mesh(self, mesh: RestMesh) -> None:
        """Write the mesh of the resting body to the file that the loop reads at its start.

        Raises:
            AnotherObject: An earlier call has written a different mesh.
            DeviceError: There is no room for the file.
        """
        if self._mesh not in (None, mesh):
            raise AnotherObject
        if self._mesh is None:
            with _room(self._settings.device.name):
                self._mesh_file.write_bytes(mesh.encode())
            self._mesh = mesh

    def start(self, welcome: Welcome) -> None:
        """Start the loop for the welcome message's body; do nothing if the loop runs for that body.

        Raises:
            AnotherObject: The loop runs for another body or another simulation period.
        """
        if self._welcome is None:
            rest_mesh = str(self._mesh_file) if self._mesh is not None else None
            config = loop_config(
                self._settings,
                welcome,
                memory=self._memory.path,
                clock_origin=self._clock.origin,
                rest_mesh=rest_mesh,
                mesh=self._mesh,
                every_row=self._keep is not None,
            )
            config = replace(config, fault=self._fault, passed=bool(self._passed))
            self._fault = ""
            self._welcome = welcome
            self.silent_after = config.limits.silent_after
            self._process = HapticProcess(config, self._memory, self._passed)
            self._want_rows(self._process)
        elif (welcome.body, welcome.simulation_period) != (
            self._welcome.body,
            self._welcome.simulation_period,
        ):
            raise AnotherObject

    def record(self, *, on: bool) -> None:
        """Keep the rows of all periods for the server from now on, or no longer."""
        self.rows_out = (self.rows_out or RowsOut()) if on else None
        if self._process is not None:
            self._want_rows(self._process)

    def _want_rows(self, process: HapticProcess) -> None:
        process.every_row = self._keep is not None or self.rows_out is not None

    def give_patch(self, frame: bytes) -> None:
        """Pass the frame of the newest patch to the loop.

        Raises:
            RemoteProtocolError: The loop has not been started.
        """
        if self._process is None:
            limit = "a rest mesh, then samples, before it"
            raise RemoteProtocolError("message", "Patch", limit)
        self._process.give_patch(frame)

    def move_to(self, point: Vec3, seconds: float) -> None:
        """Set where a scripted tip moves, also before the loop has started.

        Args:
            point: Place in the world frame [m].
            seconds: Time in which to get there; longer if that is too fast for a hand [s].
        """
        self._memory.target.write(TARGET.pack(*point, seconds))

    def newest_row(self) -> Row | None:
        """Return the row of the newest period; of the last one after the end; None before."""
        if self._process is not None:
            # The memory is closed at the end, perhaps by another thread.
            with contextlib.suppress(ValueError):
                return self._process.newest_row()
        return self.row

    @property
    def lost_rows(self) -> int:
        """Number of rows that were lost, because this process stood still for seconds."""
        return 0 if self._process is None else self._process.lost_rows

    def newest_sample(self) -> TipSample | None:
        """Return the tip and force of the newest period; None before the first period."""
        return self._process.newest_sample() if self._process is not None else None

    def beat(self) -> str:
        """Send a heartbeat to the loop, and read the loop's report and new rows.

        Returns:
            Fault of the loop, or one since the last heartbeat that is over; empty for none.

        Raises:
            DeviceError: The loop has ended because of its device, or died.
        """
        if self._process is None:
            return ""
        self._process.beat()
        self._collect(self._process)
        status = self._process.status
        fault, faults = str(status.get("fault", "")), status.get("faults", 0)
        if faults != self._faults and not fault:
            fault = str(status.get("last_fault", ""))
        self._faults = faults
        return fault

    def acknowledge(self) -> None:
        """Tell the loop that the user has acknowledged its fault."""
        if self._process is not None:
            self._process.acknowledge()

    async def stop(self) -> None:
        """Fade the force and end the loop; return when the loop has ended."""
        if self._process is not None:
            self._process.request_stop()
            await asyncio.to_thread(self._process.wait)
            self._process.read_status()
            self._collect(self._process)

    def close(self) -> None:
        """Remove the file of the shared memory and the mesh's file."""
        self._memory.close(remove=True)
        self._mesh_file.unlink(missing_ok=True)

    def _collect(self, process: HapticProcess) -> None:
        rows = process.new_rows()
        if rows:
            self.row = last_row(rows)
            if self._keep is not None:
                self._keep(rows)
            if self.rows_out is not None:
                self.rows_out.keep(rows)


@contextlib.contextmanager
def _room(device: str) -> Generator[None, None, None]:
    """Turn the OSError of a full disk or memory into a DeviceError with advice."""
    try:
        yield
    except OSError as error:
        problem = f"there is no room for its loop's memory ({error.strerror})"
        advice = "make room in /dev/shm or in the folder for temporary files"
        raise DeviceError(device, problem, advice) from error


def loop_config(
    settings: ClientSettings,
    welcome: Welcome,
    *,
    memory: str,
    clock_origin: float,
    rest_mesh: str | None,
    mesh: RestMesh | None,
    every_row: bool,
) -> LoopConfig:
    """Make the configuration of a client's loop from its settings and the server's welcome message.

    Args:
        memory: Path of the shared memory.
        clock_origin: Origin of this process's clock [s].
        rest_mesh: Path of the file with the resting mesh; None if patches have no mesh.
        mesh: The resting mesh, on which a simulated hand is placed; None if patches have no mesh.
        every_row: Whether the loop writes a row for every period.
    """
    device = device_info(settings.device)
    body, simulation_period = welcome.body, welcome.simulation_period
    period = haptic_period(settings.loop_hz)
    limits = SafetyLimits(
        max_force=settings.force_limit,
        max_rate=rate_of(device.max_stiffness),
        stall=device.stall,
        silent_after=silent_after(simulation_period),
        period=period,
        stale=max(2.0 * period, 2.0 / device.rate),
        latch=settings.holds_faults,
        dead_man=settings.dead_man,
    )
    script = settings.script
    if script.place is not None:  # given in the frame of the object's file
        at = body.from_file(script.place.point)
        script = replace(script, place=replace(script.place, point=at))
    if mesh is not None and script.place is None and settings.device.name == "simulated":
        place = cast(mesh, body.center, body.radius, body.contact_radius, script.angle)
        script = replace(script, place=place)
    intention = script.intention(body.center, body.radius)
    return LoopConfig(
        memory=memory,
        clock_origin=clock_origin,
        haptic_period=period,
        simulation_period=simulation_period,
        law=law_settings(settings.thresholds, simulation_period, limits),
        smoothing=settings.smoothing,
        friction=settings.friction,
        rules=tuple(rule if isinstance(rule, str) else "" for rule in settings.rules),
        follow=settings.fixed_gains is None,
        max_damping=settings.damping_limit,
        device=DeviceConfig(
            settings.device, body.center, body.radius, settings.script.hand, intention
        ),
        limits=limits,
        rest_mesh=rest_mesh,
        every_row=every_row,
    )
