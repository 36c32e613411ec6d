"""A hand whose place comes by UDP, from a camera or another program on this machine.

Each datagram is three numbers in text, `x y z`: right, away from the user and up [m]. It has no
motors, so the hand feels nothing and others feel it.
"""

from __future__ import annotations

import math
import socket

from cohaptic import DeviceError
from cohaptic.vec import ZERO, Vec3, scale, sub
from cohaptic_client import (
    PLACING_OPTIONS,
    DeviceChoice,
    DeviceConfig,
    DeviceInfo,
    DeviceKind,
    DeviceSample,
    Placed,
    place,
    placed_info,
)

# The loop counts a position as old as two reports: at 60 of them in a second a hand may move by
# 50 mm from one to the next.
INFO = DeviceInfo("tracker", max_force=0.0, max_stiffness=1000.0, rate=60.0, force_axes=0)
SILENCE = 0.1  # s without a datagram after which the hand is not seen any more
REACH = 2.0  # m; nothing farther from the middle is a hand
FASTEST = 1.5  # m/s; the safety layer lets go of what is faster, and a tracker makes mistakes
_LARGEST = 32  # datagrams that one period looks at; the newest counts
_LONGEST = 1 << 16  # bytes; no datagram is longer


class Tracker:
    """The tip where the newest datagram says it is."""

    info = INFO

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            # Nobody on the network can move the hand.
            self._socket.bind(("127.0.0.1", port))
        except OSError as error:
            self._socket.close()
            raise DeviceError("tracker", f"port {port} cannot be had ({error})") from error
        self._socket.setblocking(False)
        self._position = self._velocity = ZERO
        self._seen = -math.inf  # when the newest datagram came [s]

    def read(self, now: float) -> DeviceSample:
        """The newest place; not fresh while nothing comes."""
        newest: Vec3 | None = None
        for _ in range(_LARGEST):
            try:
                newest = _place_of(self._socket.recv(_LONGEST)) or newest
            except BlockingIOError:
                break
            except OSError as error:
                raise DeviceError("tracker", f"its socket is gone ({error})") from error
        if newest is not None:
            self._take(newest, now)
        fresh = now - self._seen <= SILENCE
        return DeviceSample(self._position, self._velocity if fresh else ZERO, fresh=fresh)

    def write(self, force: Vec3) -> None:
        """Nothing: there are no motors."""

    def release(self) -> None:
        """Nothing, for the same reason."""

    def close(self) -> None:
        """Close the port; may be called twice."""
        self._socket.close()

    def _take(self, position: Vec3, now: float) -> None:
        """Go to a place, unless no hand can be there."""
        passed, way = now - self._seen, math.dist(position, self._position)
        if passed <= SILENCE and way > FASTEST * passed:
            return
        # After a silence the hand may be anywhere, and nobody knows how fast it is.
        seen = 0.0 < passed <= SILENCE
        self._velocity = scale(sub(position, self._position), 1.0 / passed) if seen else ZERO
        self._position, self._seen = position, now


def _place_of(datagram: bytes) -> Vec3 | None:
    """Three numbers; None where they are not three, not finite, or too far away."""
    try:
        x, y, z = map(float, datagram.split())
    except ValueError:
        return None
    return (x, y, z) if math.hypot(x, y, z) <= REACH else None


def port_of(choice: DeviceChoice) -> int:
    """UDP port to listen on; raises SettingError."""
    return int(choice.number("port", 9700, 1024, 65535))


def abilities(choice: DeviceChoice) -> DeviceInfo:
    """Abilities with these options; raises SettingError."""
    port_of(choice)
    return placed_info(choice, INFO)


def open_tracker(config: DeviceConfig) -> Placed:
    """Listen; raises DeviceError where the port is taken."""
    return place(Tracker(port_of(config.choice)), config, middle=ZERO)


KIND = DeviceKind(
    "tracker",
    "a hand whose place another program sends by UDP; it only senses",
    (("port", "on which it listens, 9700 if it is not given"), *PLACING_OPTIONS),
    abilities,
    open_tracker,
)
