"""A part of a patch: the other hands, for a client that moves models of them (science 3.15)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

from cohaptic.control.hand_model import HandModel
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.frame import MAX_FORCE, MAX_POSITION, check_range
from cohaptic.protocol.layout import COUPLED, PARTNER, PARTNERS

_HEAD: Final = PARTNERS.packer()
_ITEM: Final = PARTNER.packer()
_COUPLED: Final = COUPLED.packer()
# The haptic loop solves for all hands in each period, and a patch has a column of C for each.
MAX_PARTNERS: Final = 7
_U32: Final = 2**32 - 1
# From a hand on a light device to an arm on a heavy one, or to the page's hand that holds firmly.
LIGHTEST: Final = HandModel(0.03, 0.5, 50.0)
HEAVIEST: Final = HandModel(0.8, 100.0, 1e4)
MAX_CARRIED: Final = 300.0  # N, as in a scene
_LEAST, _LARGEST = 1e-6 * (1.0 - 1e-6), 10.0 * (1.0 + 1e-6)  # m/N, with the rounding of 32 bits


class Partner(NamedTuple):
    """Another hand, as a client's model of it needs it.

    Fields:
        user: Number of the user.
        model: Model of the hand.
        intended: Depth of the tip below the surface without any force, plus `deflection` [m].
        deflection: Displacement of the model that the hand's own client told [m].
        force: Normal force of this hand in the patch's surface [N].
        max_force: Largest force of this hand [N].
        c_jj: Compliance of its contact and its device [m/N].
        coupled: Compliance between its contact and that of the client, and between its contact and
            that of each partner before it [m/N].
    """

    user: int
    model: HandModel
    intended: float
    deflection: float
    force: float
    max_force: float
    c_jj: float
    coupled: tuple[float, ...]


@dataclass(init=False)
class Partners:
    """The other hands of a room, in front of one client.

    Args:
        weight: Share of the models' forces in what the client shows, 0 to 1; the rest is that of
            the forces in the patch's surface.
        max_force: Largest force that the body takes of the client's own hand [N].
        model: Model of that hand.
        partners: The others, at most `MAX_PARTNERS`.
    """

    weight: Final[float]
    max_force: Final[float]
    model: Final[HandModel]
    partners: Final[tuple[Partner, ...]]

    def __init__(
        self, weight: float, max_force: float, model: HandModel, partners: tuple[Partner, ...]
    ) -> None:
        self.weight = weight
        self.max_force = max_force
        self.model = model
        self.partners = partners

    @property
    def users(self) -> tuple[int, ...]:
        """Numbers of the others."""
        return tuple(partner.user for partner in self.partners)

    def encode(self) -> bytes:
        """The bytes of this part; raises LocalProtocolError when a value is out of its limits."""
        self.check(remote=False)
        parts = [_HEAD.pack(len(self.partners), self.weight, self.max_force, *self.model)]
        for p in self.partners:
            parts.append(
                _ITEM.pack(p.user, *p.model, p.intended, p.deflection, p.force, p.max_force, p.c_jj)
            )
            parts += [_COUPLED.pack(c) for c in p.coupled]
        return b"".join(parts)

    @classmethod
    def decode(cls, data: bytes, start: int) -> tuple[Partners, int]:
        """Read this part of a frame; return it with the offset of its end. Values are not checked.

        Args:
            data: The frame.
            start: Offset at which this part begins [B].

        Raises:
            RemoteProtocolError: The frame is too short, or has too many partners.
        """
        _check_length(data, start + PARTNERS.size)
        count, weight, own, m, b, k = _HEAD.unpack_from(data, start)
        check_range("partners of a patch", count, 0, MAX_PARTNERS, remote=True)
        at, partners = start + PARTNERS.size, list[Partner]()
        for j in range(count):
            _check_length(data, at + PARTNER.size + (j + 1) * COUPLED.size)
            user, pm, pb, pk, intended, deflection, force, max_force, c_jj = _ITEM.unpack_from(
                data, at
            )
            at += PARTNER.size
            coupled = list[float]()
            for _ in range(j + 1):
                coupled.append(_COUPLED.unpack_from(data, at)[0])
                at += COUPLED.size
            model = HandModel(pm, pb, pk)
            partners.append(
                Partner(user, model, intended, deflection, force, max_force, c_jj, tuple(coupled))
            )
        return cls(weight, own, HandModel(m, b, k), tuple(partners)), at

    def check(self, *, remote: bool) -> None:
        """Raise unless every value is in its limits.

        Args:
            remote: Whether the peer made this part.
        """
        check_range("partners of a patch", len(self.partners), 0, MAX_PARTNERS, remote=remote)
        check_range("weight of the models", self.weight, 0.0, 1.0, remote=remote)
        check_range("largest force", self.max_force, 0.0, MAX_FORCE, remote=remote)
        check_model(self.model, remote=remote)
        for j, p in enumerate(self.partners):
            check_range("user of a partner", p.user, 1, _U32, remote=remote)
            check_model(p.model, remote=remote)
            max_force = 2.0 * MAX_POSITION
            check_range("depth of a partner", p.intended, -max_force, max_force, remote=remote)
            check_range(
                "deflection of a partner", p.deflection, -MAX_POSITION, MAX_POSITION, remote=remote
            )
            check_range("force of a partner", p.force, 0.0, MAX_CARRIED, remote=remote)
            check_range("largest force of a partner", p.max_force, 0.0, MAX_FORCE, remote=remote)
            check_range("c_jj of a partner", p.c_jj, _LEAST, _LARGEST, remote=remote)
            check_range("compliances of a partner", len(p.coupled), j + 1, j + 1, remote=remote)
            for c in p.coupled:
                check_range("compliance", c, -MAX_POSITION, MAX_POSITION, remote=remote)


def _check_length(data: bytes, least: int) -> None:
    if len(data) < least:
        raise RemoteProtocolError("patch length", len(data), f"at least {least} bytes")


def is_allowed(model: HandModel) -> bool:
    """Return whether all values of a model are in their limits, beyond any rounding."""
    m, b, k = model
    return (
        LIGHTEST.mass <= m <= HEAVIEST.mass
        and LIGHTEST.damping <= b <= HEAVIEST.damping
        and LIGHTEST.stiffness <= k <= HEAVIEST.stiffness
    )


def check_model(model: HandModel, *, remote: bool) -> None:
    """Raise unless a model's values are in their limits.

    Args:
        model: Model of a hand.
        remote: Whether the peer made it.
    """
    names = ("mass", "damping", "stiffness")
    for name, value, low, high in zip(names, model, LIGHTEST, HEAVIEST, strict=True):
        # 32 bits round a limit by so much.
        check_range(f"{name} of a model", value, low * (1 - 1e-6), high * (1 + 1e-6), remote=remote)
