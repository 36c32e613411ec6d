"""A device with a simulated hand on it: the same loop and safety layer as for a real one."""

from __future__ import annotations

from cohaptic.simulated.hand import Hand, HandState, Intention, move
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceInfo, DeviceSample

_SUBSTEP = 0.001  # s; the longest that `hands.move` may take
_MAX_CATCH_UP = (
    0.1  # s; after a longer stall of the process the hand goes on from its last position
)

# A simulated hand stands still with the process that stalls, and nobody is hurt by it.
# It is a rig in virtual air: well damped, so that the laws and not the device are on trial.
INFO = DeviceInfo("simulated", max_force=10.0, max_stiffness=2000.0, damping=10.0, stall=1.0)


class SimulatedDevice:
    """A hand that follows an intention and feels the force that the loop writes.

    Args:
        hand: Its mechanics.
        intention: Of the hand; its time starts with the first `read`.
    """

    def __init__(self, hand: Hand, intention: Intention) -> None:
        self._hand = hand
        self._intention = intention
        self._state = HandState(intention.at(0.0), ZERO)
        self._force = ZERO
        self._start: float | None = None
        self._now = 0.0

    @property
    def info(self) -> DeviceInfo:
        """Abilities of every simulated device."""
        return INFO

    def read(self, now: float) -> DeviceSample:
        """Move the hand up to `now` under the force written last."""
        if self._start is None:
            self._start = self._now = now
        remaining = min(now - self._now, _MAX_CATCH_UP)
        while remaining > 1e-9:
            dt = min(remaining, _SUBSTEP)
            target = self._intention.at(now - remaining + dt - self._start)
            self._state = move(self._state, self._hand, target, self._force, dt)
            remaining -= dt
        self._now = now
        level = self._intention.level(now - self._start)
        return DeviceSample(self._state.position, self._state.velocity, level)

    def write(self, force: Vec3) -> None:
        """Force on the hand until the next read [N]."""
        self._force = force

    def close(self) -> None:
        """Let the hand go."""
        self._force = ZERO
