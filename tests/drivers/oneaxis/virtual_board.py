"""The real firmware, its handle and its hand in virtual time, behind the driver's own `Handle`."""

from __future__ import annotations

from cohaptic_drivers.oneaxis.frames import Description, Reader, Report, command, identify
from cohaptic_drivers.oneaxis.handle import Handle
from cohaptic_drivers.oneaxis.unit import Unit
from tests.drivers.oneaxis.firmware import Rig

PERIOD = 0.001  # s
PER_METRE = 80_000.0
# Of the rig: 6 N for an ampere at the handle.
UNIT = Unit(
    handle_radius=0.08, gear=20.0, counts_per_metre=PER_METRE, torque_constant=0.024, max_force=3.0
)


class VirtualBoard:
    """A clock, and the way to a board that goes on as the clock does."""

    def __init__(self) -> None:
        self.rig = Rig(per_metre=PER_METRE)
        self.time = 0.0
        self._reader = Reader()
        self._report: Report | None = None
        self._sequence = 0

    def handle(self, unit: Unit = UNIT) -> Handle:
        """The driver on this board, which presses away from the user."""
        (described,) = self._reader.take(self.rig.receive(identify(0), self.time))
        assert isinstance(described, Description)
        self.send(0.0)
        first = self.poll()
        assert first is not None
        return Handle(unit, self, described, first, axis=(0.0, 1.0, 0.0))

    def now(self) -> float:
        return self.time

    def sleep_until(self, when: float) -> None:
        while self.time < when - 1e-9:
            self.time += 0.5 * PERIOD
            self.rig.step(self.time, 0.5 * PERIOD)

    def send(self, amperes: float) -> None:
        self._sequence += 1
        (reported,) = self._reader.take(
            self.rig.receive(command(self._sequence, amperes), self.time)
        )
        assert isinstance(reported, Report)
        self._report = reported

    def poll(self) -> Report | None:
        reported, self._report = self._report, None
        return reported

    def release(self) -> None:
        self.send(0.0)

    def close(self) -> None:
        self.rig.close()
