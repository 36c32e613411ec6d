"""The haptic loop as it runs, from the bytes of a server to the forces on a hand, in virtual time.

Session, shared memory, intake, housekeeping and laws are those of the product; the clock and the
device are scripted.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.messages import BodyInfo, Welcome, encode_control
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.loop.memory import COMMAND, SAMPLE, LoopMemory
from cohaptic_client.loop.running import haptic_loop
from cohaptic_client.loop.safety import SafetyLimits
from cohaptic_client.network.session import ClientSession
from tests.client.plane import CONFIG, PLANE

PERIOD, TICK = 0.001, 16  # s; periods between two patches of a friendly server
APPROACH, AT_REST = 50, 400  # periods: the hand goes in; it has rested, and its force too
DEPTH = 0.004  # m, at which it rests
SIDE, PITCH = 9, 0.01  # vertices along the resting square, and their distance [m]
GRID = [
    (PITCH * (i - SIDE // 2), PITCH * (j - SIDE // 2), 0.0)
    for i in range(SIDE)
    for j in range(SIDE)
]
MESH = RestMesh(
    tuple(GRID),
    tuple(
        face
        for i in range(SIDE - 1)
        for j in range(SIDE - 1)
        for a in [i * SIDE + j]
        for face in ((a, a + SIDE, a + 1), (a + 1, a + SIDE, a + SIDE + 1))
    ),
)
NEAR = Neighbourhood.of(range(len(GRID)), (ZERO,) * len(GRID), (PLANE.c_ii,) * len(GRID))
BODY = BodyInfo(name="square", center=ZERO, radius=0.1, contact_radius=0.02)
WELCOME = Welcome(user=1, name="left", simulation_period=1.0 / 60.0, body=BODY, users=())


def good(tick: int, *, mesh: bool) -> Patch:
    """The resting square, as a plane or a mesh."""
    t = tick * TICK * PERIOD
    if not mesh:
        return replace(PLANE, tick=tick, t_server=t)
    return replace(PLANE, tick=tick, t_server=t, geometry=Geometry.MESH, neighbourhood=NEAR)


@dataclass
class Seen:
    """What became of a touch, period by period.

    Args:
        forces: That the device got [N].
        ticks: Of the patch in use; 0 for none.
        accepted: Ticks of the patches that the network's process gave to the loop.
        refused: Why the session ended; empty while it has not.
    """

    forces: list[Vec3] = field(default_factory=list[Vec3])
    ticks: list[int] = field(default_factory=list[int])
    accepted: list[int] = field(default_factory=list[int])
    refused: str = ""


class Over(Exception):
    """The periods are over."""


class Touch:
    """A hand, a server's messages and the loop between them.

    Args:
        folder: For the resting mesh.
        messages: From the server, by the period in which they come.
        meddle: Called before each period with its number and the memory.
        periods: How many.
    """

    info = DeviceInfo("scripted", max_force=10.0, max_stiffness=1000.0)

    def __init__(
        self,
        folder: Path,
        messages: Mapping[int, list[bytes]],
        periods: int,
        meddle: Callable[[int, LoopMemory], None] = lambda _n, _m: None,
    ) -> None:
        self.seen = Seen()
        self.memory = LoopMemory.create()
        self._messages, self._periods, self._meddle = messages, periods, meddle
        self._n = 0
        self._session = ClientSession()
        self._session.receive(encode_control(WELCOME))
        self._session.receive(MESH.encode())
        self._mesh = folder / "mesh"
        self._mesh.write_bytes(MESH.encode())

    def run(self) -> Seen:
        """Play all periods; what the loop raises is raised."""
        config = replace(
            CONFIG,
            memory=self.memory.path,
            clock_origin=0.0,
            limits=SafetyLimits(engage_time=0.1),
            rest_mesh=str(self._mesh),
        )
        try:
            with _virtual_time(self.network):
                haptic_loop.HapticLoop(config, LoopMemory(self.memory.path), self).run()
        except Over:
            pass
        finally:
            self.memory.close(remove=True)
        return self.seen

    def read(self, now: float) -> DeviceSample:
        """The device's part of a period."""
        fraction = min(1.0, max(0.0, (self._n - APPROACH) / 200.0))
        moving = 0.0 < fraction < 1.0
        velocity = (0.0, 0.0, -2.0 * DEPTH / (200.0 * PERIOD) if moving else 0.0)
        return DeviceSample((0.0, 0.0, DEPTH - 2.0 * DEPTH * fraction), velocity)

    def write(self, force: Vec3) -> None:
        """The device's other part."""
        self.seen.forces.append(force)

    def close(self) -> None:
        """Nothing to be closed."""

    def network(self) -> None:
        """Between two periods: the network's process hears, and the loop's sample is read."""
        sample = self.memory.sample.read()
        if sample is not None:
            self.seen.ticks.append(SAMPLE.unpack(sample)[1])
        if self._n >= self._periods:
            raise Over
        self.memory.command.write(COMMAND.pack(self._n, False, True, 0))
        for message in self._messages.get(self._n, []):
            self._hear(message)
        self._meddle(self._n, self.memory)
        self._n += 1

    def _hear(self, message: bytes) -> None:
        if self.seen.refused:
            return
        try:
            event = self._session.receive(message)
        except RemoteProtocolError as error:
            self.seen.refused = str(error)
            return
        assert isinstance(event, Patch)
        self.memory.patch.write(message)
        self.seen.accepted.append(event.tick)


@contextmanager
def _virtual_time(asleep: Callable[[], None]) -> Generator[None]:
    """Time passes only where the loop sleeps, and there the network's process does its work."""

    class Clock:
        def __init__(self, origin: float) -> None:
            self.t = origin + 1.0

        def now(self) -> float:
            return self.t

        def sleep_until(self, when: float) -> None:
            self.t = max(self.t, when)
            asleep()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(haptic_loop, "SystemClock", Clock)
        yield
