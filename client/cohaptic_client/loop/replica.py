"""The other hands at this end: models of them answer this hand at the haptic rate (science 3.15).

A patch's surface contains the forces that the others had one way ago. They are replaced by those
that models of the others have now, which give way to this hand at once. From the others only comes
what they want: the depth that each would have if no force moved it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from cohaptic.control.geometry import Sight
from cohaptic.control.hand_model import Give, HandModel, contact_forces, give_way
from cohaptic.protocol.partners import Partners
from cohaptic.vec import add, scale

_NUMBERS: Final = 3  # of a partner in `Replica.shown` that come before its compliances


@dataclass(init=False)
class Replica:
    """The models in one period.

    Fields:
        news: Partners of the newest patch.
        before: What was shown when that patch came, in the order of `numbers_of`.
        after: What is shown when the move to that patch is complete.
        gives: Give of the own hand, and of each partner.
        forces: Force of the own hand, and of each partner, in the last period [N].
    """

    news: Final[Partners]
    before: Final[list[float]]
    after: Final[list[float]]
    gives: Final[list[Give]]
    forces: Final[list[float]]

    def __init__(
        self,
        news: Partners,
        before: list[float],
        after: list[float],
        gives: list[Give],
        forces: list[float],
    ) -> None:
        self.news = news
        self.before = before
        self.after = after
        self.gives = gives
        self.forces = forces


def numbers_of(partners: Partners) -> list[float]:
    """Return the numbers that move from patch to patch: the weight, and of each partner its wish,
    its force in the surface and its compliances.
    """
    numbers = [partners.weight]
    for p in partners.partners:
        numbers.append(p.intended)
        numbers.append(p.force)
        numbers.append(p.c_jj)
        numbers += p.coupled
    return numbers


def at(j: int) -> int:
    """Return the place of the first number of partner `j` in `numbers_of`."""
    return 1 + _NUMBERS * j + j * (j + 1) // 2


def follow(replica: Replica | None, news: Partners, share: float) -> Replica:
    """Return the models with the partners of a new patch.

    Args:
        replica: Models after the last period; None before the first patch with partners.
        news: Partners of the new patch.
        share: Completed fraction of the move to the patch before, 0 to 1.
    """
    after = numbers_of(news)
    if replica is None:
        gives = [Give()] + [Give(p.give) for p in news.partners]
        return Replica(news, after, after, gives, [0.0] + [p.force for p in news.partners])
    shown, users = shown_numbers(replica, share), replica.news.users
    if users == news.users:
        return Replica(news, shown, after, replica.gives, replica.forces)
    # A hand that comes begins where its patch says; the others stay as they are shown.
    before, gives, forces = list(after), [replica.gives[0]], [replica.forces[0]]
    before[0] = shown[0]
    old = {user: j for j, user in enumerate(users)}
    places = [old.get(user, -1) for user in news.users]
    for j, p in enumerate(news.partners):
        i = places[j]
        gives.append(replica.gives[i + 1] if i >= 0 else Give(p.give))
        forces.append(replica.forces[i + 1] if i >= 0 else p.force)
        if i < 0:
            continue
        to, of = at(j), at(i)
        for k in range(_NUMBERS + 1):  # with the compliance to the own contact
            before[to + k] = shown[of + k]
        for earlier in range(j):
            h = places[earlier]
            if h >= 0:
                of = at(max(h, i)) + _NUMBERS + 1 + min(h, i)
                before[to + _NUMBERS + 1 + earlier] = shown[of]
    return Replica(news, before, after, gives, forces)


def shown_numbers(replica: Replica, share: float) -> list[float]:
    """Return the numbers of `numbers_of` in this period."""
    if share >= 1.0:
        return replica.after
    return [a + share * (b - a) for a, b in zip(replica.before, replica.after, strict=True)]


def answer(
    replica: Replica, sight: Sight, share: float, k_h: float, most: float
) -> tuple[list[float], Sight]:
    """Compute the forces of all hands in a period.

    Args:
        replica: Models after the last period.
        sight: Surface of the patches at the probe.
        share: Completed fraction of the move to the newest patch, 0 to 1.
        k_h: Gain of the own law [N/m].
        most: Largest force on the own hand [N].

    Returns:
        Force of the own hand and of each partner [N], and the surface with the models' forces in
        place of those that it came with.
    """
    partners = replica.news.partners
    if not partners or k_h <= 0.0:
        return [0.0] * (1 + len(partners)), sight
    numbers, n = shown_numbers(replica, share), 1 + len(partners)
    weight, without = numbers[0], 0.0
    C = [[0.0] * n for _ in range(n)]
    depth, limits = [sight.depth], [most]
    C[0][0] = 1.0 / k_h
    for j, p in enumerate(partners):
        i, to = at(j), j + 1
        C[to][to] = numbers[i + 2]
        for k in range(to):
            C[to][k] = C[k][to] = numbers[i + _NUMBERS + k]
        without += weight * C[0][to] * numbers[i + 1]
        C[0][to] *= weight
        depth.append(numbers[i] - replica.gives[to].y)
        limits.append(p.most)
    depth[0] += without
    forces = contact_forces(C, depth, limits, replica.forces)
    shift = without
    for k in range(1, n):
        shift -= C[0][k] * forces[k]
    moved = add(sight.u_others, scale(sight.normal, shift))
    return forces, Sight(sight.depth + shift, sight.normal, sight.c_ii, sight.own_force, moved)


def move(replica: Replica, forces: list[float], own: float, dt: float) -> Replica:
    """Return the models after a period.

    Args:
        replica: Models before it.
        forces: Force of each hand in it, from `answer` [N].
        own: Normal force that the own hand got [N].
        dt: Duration [s].
    """
    models: list[HandModel] = [replica.news.model]
    models += [p.model for p in replica.news.partners]
    felt = [own, *forces[1:]]
    gives = [
        give_way(give, model, force, dt)
        for give, model, force in zip(replica.gives, models, felt, strict=True)
    ]
    return Replica(replica.news, replica.before, replica.after, gives, forces)
