"""A device with a simulated hand, for the same loop and safety layer as a real device.

A preset gives the simulated device the limits and the mechanics of a real one. The largest force,
stiffness and damping are those that CHAI3D ships for each device (`src/devices`), and for the
Inverse3 those of a fork of CHAI3D; forces are short-time maxima. All other values are an ASSUMPTION
of the size that data sheets and measurements of such devices report, not checked on a device:

- the physical damping b has exactly the value that Colgate's bound requires at the stiffness K and
  the period T = 1 ms, b = K T / 2, because the authors judged the stiffness usable. This leaves
  nothing for the passivity layer: its budget is 0, and the room's lag has to do without it
  (science 3.8);
- the apparent mass and the Coulomb friction of the tip, the resolution of its sensors, and the time
  from a motion to its report.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Final

from cohaptic.simulated.hand import Hand, HandState, Intention, move
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind

_SUBSTEP: Final = 0.001  # s; longest step for which `move` is stable
# s; after a longer stall of the process the hand goes on from its last position
_MAX_CATCH_UP: Final = 0.1
# s; time constant with which a driver derives a velocity from the steps of its sensors
_VELOCITY_FILTER: Final = 0.005
_LONGEST_LATENCY: Final = 64  # most delayed reports: 16 ms of a device that is read at 4 kHz
# The stall is long, because a simulated hand stops with a process that stalls, and hurts nobody.
# This device, the rig, is well damped, so that tests show the laws and not the device.
INFO = DeviceInfo(
    "simulated", max_force=10.0, max_stiffness=2000.0, damping=10.0, stall=1.0, held=False
)


class SimulatedDevice:
    """A hand that follows an intention and feels the force that the loop writes.

    The damping of `INFO` is only declared; the hand's own damping acts in its place. With a preset,
    the mechanics include the preset's damping, mass, friction, resolution, latency and largest
    force.

    Args:
        hand: Mechanics of the hand.
        intention: Intention of the hand. Its time starts at the first `read`; if `waits` is True,
            it starts when the hand is engaged.
        waits: Whether the hand stays at its starting point until it is engaged.
    """

    def __init__(
        self, hand: Hand, intention: Intention, info: DeviceInfo = INFO, *, waits: bool = False
    ) -> None:
        self._info = info
        self._modelled = info.inertia > 0.0
        if self._modelled:
            mass, damping = hand.mass + info.inertia, hand.damping + info.damping
            hand = replace(hand, mass=mass, damping=damping)
        self._hand = hand
        self._intention = intention
        self._waits = waits
        self._state = HandState(intention.position(0.0), ZERO)
        self._force = ZERO
        self._start: float | None = None
        self._now = 0.0
        self._reports = deque[tuple[float, Vec3]](maxlen=_LONGEST_LATENCY)
        self._seen = self._state.position
        self._velocity = ZERO

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        return self._info

    def read(self, now: float) -> DeviceSample:
        """Move the hand up to time `now` [s] under the last force; return the state of the tip."""
        if self._start is None:
            self._start, self._now = math.inf if self._waits else now, now
        passed = now - self._now
        remaining = min(passed, _MAX_CATCH_UP)
        while remaining > 1e-9:
            dt = min(remaining, _SUBSTEP)
            target = self._intention.position(now - remaining + dt - self._start)
            self._move(target, dt)
            remaining -= dt
        self._now = now
        level = self._intention.level(now - self._start)
        if not self._modelled:
            return DeviceSample(self._state.position, self._state.velocity, level)
        self._sense(now, passed)
        return DeviceSample(self._seen, self._velocity, level)

    def engaged(self, now: float) -> None:
        """Start the intention of a waiting hand, which can feel a force from time `now` on [s]."""
        if self._start == math.inf:
            self._start = now

    def write(self, force: Vec3) -> None:
        """Give `force` [N] to the hand until the next call."""
        size = norm(force)
        if self._modelled and size > self._info.max_force:
            force = scale(force, self._info.max_force / size)
        self._force = force

    def close(self) -> None:
        """Set the force on the hand to zero."""
        self._force = ZERO

    def _move(self, target: Vec3, dt: float) -> None:
        """Move the hand towards `target` [m] for `dt` [s]; the device's friction brakes it."""
        before = self._state
        self._state = move(before, self._hand, target, self._force, dt)
        if self._info.friction <= 0.0:
            return
        velocity = self._state.velocity
        speed, taken = norm(velocity), self._info.friction * dt / self._hand.mass
        velocity = scale(velocity, 1.0 - taken / speed) if speed > taken else ZERO
        x, v = before.position, velocity
        place = (x[0] + dt * v[0], x[1] + dt * v[1], x[2] + dt * v[2])
        self._state = HandState(place, velocity)

    def _sense(self, now: float, passed: float) -> None:
        """Update the sensed position and velocity, which the sensors quantise and delay."""
        x, step = self._state.position, self._info.resolution
        if step > 0.0:
            x = (step * round(x[0] / step), step * round(x[1] / step), step * round(x[2] / step))
        self._reports.append((now, x))
        while len(self._reports) > 1 and self._reports[1][0] <= now - self._info.latency + 1e-9:
            self._reports.popleft()
        if passed > 0.0:
            fraction = passed / (passed + _VELOCITY_FILTER)
            way = scale(sub(self._reports[0][1], self._seen), 1.0 / passed)
            v = self._velocity
            self._velocity = (
                v[0] + fraction * (way[0] - v[0]),
                v[1] + fraction * (way[1] - v[1]),
                v[2] + fraction * (way[2] - v[2]),
            )
        self._seen = self._reports[0][1]


_PERIOD: Final = 0.001  # s; period of the loops for which the stiffness was judged usable


def _preset(
    name: str,
    *,
    force: float,
    stiffness: float,
    damping: float,
    mass: float,
    friction: float,
    step: float,
    latency: float,
) -> DeviceInfo:
    """Make the abilities of a simulated device with the limits and mechanics of a real one.

    Args:
        name: Name shown to users.
        force: Largest force [N].
        stiffness: Largest stiffness that is rendered stably [N/m].
        damping: Largest damping that may be rendered [N s/m].
        mass: Apparent mass of the tip [kg].
        friction: Friction of the mechanics [N].
        step: Smallest change of position that the sensors can tell [m].
        latency: Time from a motion to its report [s].
    """
    return DeviceInfo(
        name,
        max_force=force,
        max_stiffness=stiffness,
        damping=0.5 * stiffness * _PERIOD,
        stall=1.0,  # as for every simulated hand
        max_damping=damping,
        inertia=mass,
        friction=friction,
        resolution=step,
        latency=latency,
        held=False,
    )


PRESETS: Final = {
    "touch": _preset(
        "simulated Touch", force=3.3, stiffness=400.0, damping=4.0,
        mass=0.045, friction=0.26, step=55e-6, latency=0.001,
    ),
    "omni": _preset(
        "simulated Phantom Omni", force=3.3, stiffness=700.0, damping=5.0,
        mass=0.045, friction=0.26, step=55e-6, latency=0.001,
    ),
    "desktop": _preset(
        "simulated Phantom Desktop", force=7.9, stiffness=1000.0, damping=5.0,
        mass=0.045, friction=0.06, step=23e-6, latency=0.001,
    ),
    "falcon": _preset(
        "simulated Falcon", force=8.0, stiffness=3000.0, damping=20.0,
        mass=0.1, friction=0.4, step=64e-6, latency=0.001,
    ),
    "omega3": _preset(
        "simulated omega.3", force=12.0, stiffness=5000.0, damping=30.0,
        mass=0.22, friction=0.2, step=10e-6, latency=0.0005,
    ),
    "lambda7": _preset(
        "simulated lambda.7", force=12.0, stiffness=8000.0, damping=30.0,
        mass=0.3, friction=0.3, step=2e-6, latency=0.0005,
    ),
    "inverse3": _preset(
        "simulated Inverse3", force=10.0, stiffness=1000.0, damping=6.0,
        mass=0.12, friction=0.2, step=10e-6, latency=0.001,
    ),
}  # fmt: skip


_RIG = "rig"  # the default: the device of `INFO`, without a preset


def simulated_info(choice: DeviceChoice) -> DeviceInfo:
    """Return the abilities of the simulated device; raise SettingError for an unknown preset."""
    preset = choice.one_of("preset", (_RIG, *PRESETS), _RIG)
    return INFO if preset == _RIG else PRESETS[preset]


def open_simulated(config: DeviceConfig) -> SimulatedDevice:
    """Make a simulated device of the chosen preset, whose hand follows the intention."""
    assert config.intention is not None
    info = simulated_info(config.choice)
    return SimulatedDevice(config.hand, config.intention, info, waits=True)


KIND = DeviceKind(
    "simulated",
    "a hand that follows a script, on a device in virtual air",
    (("preset", f"limits and mechanics of a device: {', '.join(PRESETS)}; or {_RIG}"),),
    simulated_info,
    open_simulated,
)
