"""The room's record of a user, and the list of muted users.

A muted user stays muted after leaving and coming back. The list of muted users is bounded.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from cohaptic.control.laws.model import Gains
from cohaptic.protocol.messages import FixedGains, Hello
from cohaptic.protocol.patch import Geometry
from cohaptic_server.room.playing import Samples
from cohaptic_server.room.seats.names import Claim, looks_like
from cohaptic_server.world.state import Touch


@dataclass(slots=True)
class Member:
    """The room's record of a user; only the room changes the record.

    Args:
        user: Number of the user, which is never used twice.
        hello: Settings of the user, including later changes.
        heard: Time of the newest sample [s]; the time of joining before the first sample.
        claim: Proof of the client that the name in `hello` is its own.
        max_force: Largest force of the user on the body that device and token allow [N].
        muted: Whether an administrator keeps the user's force from the body.

    Attributes:
        joined: Time at which the user joined [s].
        samples: Samples with the user's settings, as far as they are still to be read.
        used: Number of samples that were the newest one at a tick.
        seen: Sequence number of the last sample that `used` counts.
        gains: Control gains that the user chose; None for the server's gains.
        geometry: Geometry of the user's patches.
    """

    user: int
    hello: Hello
    heard: float
    claim: Claim
    max_force: float
    muted: bool = False
    joined: float = field(init=False)
    samples: Samples = field(default_factory=Samples)
    used: int = 0
    seen: int = 0
    gains: Gains | None = field(init=False)
    geometry: Geometry = field(init=False)

    @property
    def touch(self) -> Touch | None:
        """Newest sample; None before the first sample."""
        return self.samples.waiting[-1] if self.samples.waiting else None

    def __post_init__(self) -> None:
        self.joined = self.heard
        self.gains = chosen_gains(self.hello.fixed_gains)
        self.geometry = Geometry[self.hello.geometry.upper()]


def chosen_gains(fixed: FixedGains | None) -> Gains | None:
    """Return a user's own gains in the form of the control loop; None for the server's gains."""
    return None if fixed is None else Gains(fixed.k_h, fixed.integral_gain)


MOST_MUTED = 256  # the oldest entry is dropped first; only an administrator adds entries


class Muted:
    """Names and claims of the users whom an administrator of the room has muted."""

    def __init__(self) -> None:
        self._who: list[tuple[str, Claim]] = []

    def __len__(self) -> int:
        return len(self._who)

    def add(self, name: str, claim: Claim) -> None:
        """Add a user to the muted users."""
        self.take_out(name, claim)
        self._who = [*self._who, (name, claim)][-MOST_MUTED:]

    def take_out(self, name: str, claim: Claim) -> None:
        """Remove a user from the muted users."""
        self._who = [one for one in self._who if not _is_same(one, name, claim)]

    def holds(self, name: str, claim: Claim) -> bool:
        """Whether a user is muted, recognised by its name, its secret key or its session."""
        return any(_is_same(one, name, claim) for one in self._who)


def _is_same(one: tuple[str, Claim], name: str, claim: Claim) -> bool:
    # A claim without a secret is only an address, which several users may share.
    return looks_like(one[0], name) or (claim.is_secret and claim.is_of(one[1]))
