"""A user as its room knows it, and those who are muted.

A muted user stays muted when it leaves and comes back. The list of them is bounded.
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
    """The room's record of a user; only the room changes it.

    Args:
        user: Number, which is never used twice.
        hello: Settings of the user, with its later changes.
        heard: Time of the newest message from it [s].
        claim: To its name.
        max_force: Most of its force that the body gets, by its device and its token [N].
        muted: Whether the body gets none of it.

    Attributes:
        joined: When it came [s].
        touch: Newest sample; None before the first.
        used, seen: Samples that were the newest at a tick, and the sequence number of the last.
        gains: That the user chose itself; None for the server's.
        geometry: Geometry of its patches.
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
    """As the loop computes with them; None for the server's."""
    return None if fixed is None else Gains(fixed.k_h, fixed.integral_gain)


MOST_MUTED = 256  # of whom the oldest is forgotten first; only an administrator adds to it


class Muted:
    """The muted users of one room."""

    def __init__(self) -> None:
        self._who: list[tuple[str, Claim]] = []

    def __len__(self) -> int:
        return len(self._who)

    def add(self, name: str, claim: Claim) -> None:
        """Mute somebody."""
        self.take_out(name, claim)
        self._who = [*self._who, (name, claim)][-MOST_MUTED:]

    def take_out(self, name: str, claim: Claim) -> None:
        """Mute somebody no more."""
        self._who = [one for one in self._who if not _is_same(one, name, claim)]

    def holds(self, name: str, claim: Claim) -> bool:
        """Whether somebody is muted, by its name, its secret or its session."""
        return any(_is_same(one, name, claim) for one in self._who)


def _is_same(one: tuple[str, Claim], name: str, claim: Claim) -> bool:
    # Without a secret a claim is its address, which others may share.
    return looks_like(one[0], name) or (claim.is_secret and claim.is_of(one[1]))
