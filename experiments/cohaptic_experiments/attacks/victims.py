"""The hands that are attacked, and the measures of what an attack does to them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np

from cohaptic.simulated.hand import Hand, Intention
from cohaptic.vec import Vec3, add, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.simulated import INFO, SimulatedDevice

PERIOD: Final = 0.001  # s
_SPAN: Final = 20  # ms of the second rate; a fingertip notices 0.05 N in it
_LAST: Final = 1.0  # s at the end in which a swing is measured


class Victim(NamedTuple):
    """A kind of hand.

    Fields:
        hand: Its mechanics; None for a tip on rails, which no force moves.
        sways: Further displacement of a tip on rails at a time, into the object [m].
    """

    hand: Hand | None
    sways: Callable[[float], float] | None = None


def _trembles(t: float) -> float:
    return 1e-3 * math.sin(2.0 * math.pi * 8.0 * t) if t > 2.0 else 0.0


def _stands(_: float) -> float:
    return 0.0


VICTIMS: Final[dict[str, Victim]] = {
    "clamped": Victim(None, _stands),
    "trembling": Victim(None, _trembles),
    "usual": Victim(Hand()),
    "weak": Victim(Hand(0.3, 1.0, 400.0)),
    "light": Victim(Hand(0.05, 1.0, 200.0)),
}


@dataclass
class Track:
    """What happened to a hand in each period.

    Args:
        forces: Force on the hand [N].
        tips: Position of the tip [m].
        speeds: Speed of the tip [m/s].
    """

    forces: list[Vec3] = field(default_factory=list[Vec3])
    tips: list[Vec3] = field(default_factory=list[Vec3])
    speeds: list[float] = field(default_factory=list[float])


class OnRails:
    """A device whose tip follows a path whatever the force is."""

    def __init__(
        self, intention: Intention, sways: Callable[[float], float], info: DeviceInfo
    ) -> None:
        self.info, self.track = info, Track()
        self._intention, self._sways = intention, sways
        self._start: float | None = None

    def read(self, now: float) -> DeviceSample:
        """Return the place of the tip on its path."""
        self._start = now if self._start is None else self._start
        t = now - self._start
        tip = add(self._intention.position(t), scale(self._intention.direction, self._sways(t)))
        before = self.track.tips[-1] if self.track.tips else tip
        velocity = scale(sub(tip, before), 1.0 / PERIOD)
        self.track.tips.append(tip)
        self.track.speeds.append(norm(velocity))
        return DeviceSample(tip, velocity)

    def write(self, force: Vec3) -> None:
        """Keep the force."""
        self.track.forces.append(force)

    def close(self) -> None:
        """Nothing is to be closed."""


class Moved(SimulatedDevice):
    """A simulated hand whose track is kept."""

    def __init__(self, hand: Hand, intention: Intention, info: DeviceInfo) -> None:
        super().__init__(hand, intention, info)
        self.track = Track()

    def read(self, now: float) -> DeviceSample:
        """Move the hand, and keep its place."""
        sample = super().read(now)
        self.track.tips.append(sample.position)
        self.track.speeds.append(norm(sample.velocity))
        return sample

    def write(self, force: Vec3) -> None:
        """Keep the force."""
        super().write(force)
        self.track.forces.append(force)


def seated(
    victim: Victim, intention: Intention, max_stiffness: float = INFO.max_stiffness
) -> OnRails | Moved:
    """Return a device of a given stiffness [N/m] with such a hand."""
    info = replace(INFO, max_stiffness=max_stiffness)
    if victim.hand is None:
        assert victim.sways is not None
        return OnRails(intention, victim.sways, info)
    return Moved(victim.hand, intention, info)


class Harm(NamedTuple):
    """What an attack did to a hand.

    Fields:
        step: Largest change of the force in a period [N].
        climb: Largest change of the force in 20 ms [N].
        force: Largest force [N].
        swing: Way of the tip between its farthest places in the last second [mm].
        kinetic: Largest kinetic energy in the last second [mJ].
        work: Work of the contact on the hand from the begin of the attack to its end [mJ].
        lent: Largest work of the contact on the hand since the attack began, which its spring may
            have returned later [mJ].
    """

    step: float
    climb: float
    force: float
    swing: float
    kinetic: float
    work: float
    lent: float


def harm(track: Track, mass: float, direction: Vec3, since: int) -> Harm:
    """Measure what happened to a hand since an attack began.

    Args:
        track: Track of the hand.
        mass: Mass of the hand [kg]; 0 for a tip on rails.
        direction: Direction into the object; a unit vector.
        since: First period of the attack.
    """
    forces, tips = np.array(track.forces[since - 1 :]), np.array(track.tips[since - 1 :])
    last = round(_LAST / PERIOD)
    along = tips[-last:] @ np.array(direction)
    worked = np.concatenate([[0.0], np.cumsum((forces[:-1] * np.diff(tips, axis=0)).sum(axis=1))])
    free = mass > 0.0
    return Harm(
        step=_largest(forces[1:] - forces[:-1]),
        climb=_largest(forces[_SPAN:] - forces[:-_SPAN]),
        force=_largest(forces),
        swing=1e3 * float(np.ptp(along)) if free else 0.0,
        kinetic=0.5e3 * mass * max(track.speeds[-last:]) ** 2,
        work=1e3 * float(worked[-1]) if free else 0.0,
        lent=1e3 * float(worked.max()) if free else 0.0,
    )


def _largest(vectors: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.linalg.norm(vectors, axis=1).max(initial=0.0))


def worst(harms: Sequence[Harm]) -> Harm:
    """Return the largest value of each measure."""
    return Harm(*(max(values) for values in zip(*harms, strict=True)))
