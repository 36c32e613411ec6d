"""The room's record of a user, and the list of muted users.

A muted user stays muted after leaving and coming back. The list of muted users is bounded.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from cohaptic.control.laws.model import Gains
from cohaptic.protocol.messages import Hello
from cohaptic.protocol.patch import Geometry
from cohaptic_server.room.playing import Samples
from cohaptic_server.room.seats.names import Claim, looks_like
from cohaptic_server.world.state import Participant, Touch


@dataclass(slots=True)
class Member:
    """The room's record of a user; only the room changes the record.

    Args:
        who: The user as the world knows it.
        hello: Settings of the user, including later changes.
        heard: Time of the newest sample [s]; the time of joining before the first sample.
        claim: Proof of the client that the name in `hello` is its own.
        muted: Whether an administrator keeps the user's force from the body.

    Attributes:
        joined: Time at which the user joined [s].
        samples: Samples with the user's settings, as far as they are still to be read.
        used: Number of samples that were the newest one at a tick.
        seen: Sequence number of the last sample that `used` counts.
    """

    who: Participant
    hello: Hello
    heard: float
    claim: Claim
    muted: bool = False
    joined: float = field(init=False)
    samples: Samples = field(default_factory=Samples)
    used: int = 0
    seen: int = 0

    @property
    def user(self) -> int:
        """Number of the user."""
        return self.who.user

    @property
    def touch(self) -> Touch | None:
        """Newest sample; None before the first sample."""
        return self.samples.waiting[-1] if self.samples.waiting else None

    def __post_init__(self) -> None:
        self.joined = self.heard


def participant(user: int, hello: Hello, max_force: float) -> Participant:
    """Return a user as the world knows it, from the hello of its client.

    Args:
        max_force: Largest force on the body that device and token allow [N].
    """
    fixed = hello.fixed_gains
    return Participant(
        user, hello.law, hello.max_stiffness, max_force,
        None if fixed is None else Gains(fixed.k_h, fixed.integral_gain),
        Geometry[hello.geometry.upper()], hello.friction, hello.damping_budget,
    )  # fmt: skip


MAX_MUTED = 256  # the oldest entry is dropped first; only an administrator adds entries


class Muted:
    """Names and claims of the users whom an administrator of the room has muted."""

    def __init__(self) -> None:
        self._who: list[tuple[str, Claim]] = []

    def __len__(self) -> int:
        return len(self._who)

    def add(self, name: str, claim: Claim) -> None:
        """Add a user to the muted users."""
        self.take_out(name, claim)
        self._who = [*self._who, (name, claim)][-MAX_MUTED:]

    def take_out(self, name: str, claim: Claim) -> None:
        """Remove a user from the muted users."""
        self._who = [one for one in self._who if not _is_same(one, name, claim)]

    def holds(self, name: str, claim: Claim) -> bool:
        """Whether a user is muted, recognised by its name, its secret key or its session."""
        return any(_is_same(one, name, claim) for one in self._who)


def _is_same(one: tuple[str, Claim], name: str, claim: Claim) -> bool:
    # A claim without a secret is only an address, which several users may share.
    return looks_like(one[0], name) or (claim.is_secret and claim.is_of(one[1]))
