"""The room's record of a user, and the list of muted users.

A muted user stays muted after leaving and coming back. The list of muted users is bounded.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from cohaptic.control.law import Gains
from cohaptic.protocol.messages import FixedGains, Hello
from cohaptic.protocol.patch import Geometry
from cohaptic_server.room.seats.names import Claim, looks_like
from cohaptic_server.world.state import Touch


@dataclass(slots=True)
class Member:
    """The room's record of a user; only the room changes the record.

    Args:
        user: Number of the user, which is never used twice.
        hello: Settings of the user, including later changes.
        heard: Time of the newest sample, or of joining [s].
        claim: Claim of the user to the name in `hello`.
        max_force: Limit that device and token set to the user's force on the body [N].
        muted: Whether an administrator keeps the user's force from the body.

    Attributes:
        joined: Time at which the user joined [s].
        touch: Newest sample; None before the first.
        used, seen: Number of samples that were the newest at a tick, and the sequence number of
            the last of them.
        gains: Gains that the user chose; None for the server's gains.
        geometry: Geometry of the user's patches.
    """

    user: int
    hello: Hello
    heard: float
    claim: Claim
    max_force: float
    muted: bool = False
    joined: float = field(init=False)
    touch: Touch | None = None
    used: int = 0
    seen: int = 0
    gains: Gains | None = field(init=False)
    geometry: Geometry = field(init=False)

    def __post_init__(self) -> None:
        self.joined = self.heard
        self.gains = chosen_gains(self.hello.fixed_gains)
        self.geometry = Geometry[self.hello.geometry.upper()]


def chosen_gains(fixed: FixedGains | None) -> Gains | None:
    """Gains that the user chose, as the control loop takes them; None for the server's gains."""
    return None if fixed is None else Gains(fixed.k_h, fixed.integral_gain)


MOST_MUTED = 256  # the oldest entry is dropped first; only an administrator adds entries


class Muted:
    """The muted users of one room."""

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
        """Whether a user is muted, judged by its name, its secret or its session."""
        return any(_is_same(one, name, claim) for one in self._who)


def _is_same(one: tuple[str, Claim], name: str, claim: Claim) -> bool:
    # A claim without a secret is only an address, which several users may share.
    return looks_like(one[0], name) or (claim.is_secret and claim.is_of(one[1]))
