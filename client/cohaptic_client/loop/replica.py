"""The other hands at this end: models of them answer this hand at the haptic rate (science 3.15).

A patch's surface contains the forces that the others had one way ago. They are replaced by those
that models of the others have now, which give way to this hand at once. From the others only comes
what they want: the depth that each would have if no force moved it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from cohaptic.control.geometry import Sight
from cohaptic.control.hand_model import Give, HandModel, contact_forces, give_way, stiffness
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.partners import Partners
from cohaptic.vec import add, lerp, scale
from cohaptic_client.loop.safety import EXTERNAL_RATE

_NUMBERS: Final = 4  # of a partner in `numbers_of` that come before its compliances
# s in which a step fades that partners make when they come, go or lose their models. A force of
# 2 N then changes by 0.02 N a millisecond at first, the slew's limit.
_FADE: Final = 0.1
# N/s by which what others want may change the own force. What is left of the slew's rate is for
# changes of gain and compliance; fades of the safety layer and of the law take more.
WISH_RATE: Final = 0.85 * EXTERNAL_RATE
WISH_RATE_IN_FADES: Final = 0.25 * EXTERNAL_RATE
# Speed of a model over the largest speed of the own hand of late: a light hand in resonance.
_ANSWERED: Final = 2.0
_CALM: Final = 0.2  # s; time constant with which a speed of late is forgotten
# 1/s; largest change of a model in relation to itself, twice as fast as an honest server's.
_MODEL_RATE: Final = 1.0
_TRIES: Final = 3  # to find how much of what others want is within its limit
_ROUNDING: Final = 1.0 + 1e-7  # factor; alone, a hand's own stiffness is that of its law
_ABOUT: Final = 1.01  # factor within which that is found


@dataclass(init=False)
class Replica:
    """The models in one period.

    Fields:
        news: Partners of the newest patch.
        before: Numbers that were shown when that patch came, in the order of `numbers_of`.
        after: Numbers that are shown when the move to that patch is complete.
        models: Model of the own hand, and of each partner, as they move.
        gives: Give of the own hand, and of each partner.
        forces: Force of the own hand, and of each partner, in the last period [N].
        wishes: What each partner wants, as it was shown in the last period [m]; empty before.
        explained: As in `Answer`, of the last period [m].
        shift: Displacement of the surface by the models in the last period [m].
        step: Part of it that fades, since partners came or went [m]; NaN in the first period after
            they did.
        pace: Largest speed of the own hand into or out of the surface of late [m/s].
    """

    news: Final[Partners]
    before: Final[list[float]]
    after: Final[list[float]]
    models: Final[list[HandModel]]
    gives: Final[list[Give]]
    forces: Final[list[float]]
    wishes: Final[list[float]]
    explained: Final[float]
    shift: Final[float]
    step: Final[float]
    pace: Final[float]

    def __init__(
        self,
        news: Partners,
        before: list[float],
        after: list[float],
        models: list[HandModel],
        gives: list[Give],
        forces: list[float],
        wishes: list[float],
        explained: float = 0.0,
        shift: float = 0.0,
        step: float = 0.0,
        pace: float = 0.0,
    ) -> None:
        self.news = news
        self.before = before
        self.after = after
        self.models = models
        self.gives = gives
        self.forces = forces
        self.wishes = wishes
        self.explained = explained
        self.shift = shift
        self.step = step
        self.pace = pace


def numbers_of(partners: Partners) -> list[float]:
    """Return the numbers that move from patch to patch: the weight, and those of each partner.

    They are what the partner wants, its force in the surface, its largest force and its
    compliances.
    """
    numbers = [partners.weight]
    for p in partners.partners:
        numbers.append(p.intended)
        numbers.append(p.force)
        numbers.append(p.most)
        numbers.append(p.c_jj)
        numbers += p.coupled
    return numbers


def at(j: int) -> int:
    """Return the place of the first number of partner `j` in `numbers_of`."""
    return 1 + _NUMBERS * j + j * (j + 1) // 2


def share_answered(replica: Replica | None) -> float:
    """Return the share of what others do that models answer at once, 0 to 1."""
    if replica is None or not replica.news.partners:
        return 0.0
    return replica.news.weight


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
        forces = [0.0] + [p.force for p in news.partners]
        return Replica(news, after, after, _told(news), gives, forces, [], step=math.nan)
    if replica.news.users == news.users:
        return replace(replica, news=news, before=shown_numbers(replica, share), after=after)
    # A hand that comes begins where its patch says. What this changes in the surface fades.
    old = {user: j + 1 for j, user in enumerate(replica.news.users)}
    gives, forces, wishes = [replica.gives[0]], [replica.forces[0]], list[float]()
    models = [replica.models[0]]
    for p in news.partners:
        i = old.get(p.user, 0)
        wishes.append(replica.wishes[i - 1] if i and replica.wishes else p.intended)
        models.append(replica.models[i] if i else p.model)
        gives.append(replica.gives[i] if i else Give(p.give))
        forces.append(replica.forces[i] if i else p.force)
    return Replica(
        news,
        after,
        after,
        models,
        gives,
        forces,
        wishes,
        0.0,
        replica.shift,
        math.nan,
        replica.pace,
    )


def _told(news: Partners) -> list[HandModel]:
    """Return the model of the own hand, and of each partner, as a patch says them."""
    return [news.model, *[p.model for p in news.partners]]


def _glided(models: list[HandModel], told: list[HandModel], dt: float) -> list[HandModel]:
    """Return models on their way to those that a patch says, after a time [s].

    A server may say anything: a model that jumps throws its hand, and so a force.
    """
    most = _MODEL_RATE * dt
    return [
        HandModel(
            now.mass + max(-most, min(most, then.mass / now.mass - 1.0)) * now.mass,
            now.damping + max(-most, min(most, then.damping / now.damping - 1.0)) * now.damping,
            now.stiffness
            + max(-most, min(most, then.stiffness / now.stiffness - 1.0)) * now.stiffness,
        )
        for now, then in zip(models, told, strict=True)
    ]


def shown_numbers(replica: Replica, share: float) -> list[float]:
    """Return the numbers of `numbers_of` in this period."""
    if share >= 1.0:
        return replica.after
    return [a + share * (b - a) for a, b in zip(replica.before, replica.after, strict=True)]


class Answer(NamedTuple):
    """Forces of all hands in one period.

    Fields:
        forces: Force of the own hand, and of each partner [N].
        wishes: What each partner wants, as it is shown [m].
        sight: Surface with the models' forces in place of those that it came with.
        shift: Displacement of the surface by the models [m].
        step: Part of it that fades [m].
        explained: Change of it since the last period by the own motion and by the models' [m].
        wished: Change of it since then by what partners want [m].
    """

    forces: list[float]
    wishes: list[float]
    sight: Sight
    shift: float
    step: float
    explained: float
    wished: float


class Own(NamedTuple):
    """The own hand in one period.

    Fields:
        k_h: Gain of its law [N/m].
        c_ii: Compliance of its contact in the newest patch [m/N].
        most: Largest force on it [N].
        given: Share of the law's force that the safety layer gives, 0 to 1.
        max_stiffness: Largest stiffness that its device renders stably [N/m].
        moved_in: Displacement into the surface since the last period [m].
        pace: Largest speed into or out of the surface of late [m/s].
        wish_rate: Rate at which others may change the own force [N/s].
    """

    k_h: float
    c_ii: float
    most: float
    given: float
    max_stiffness: float
    moved_in: float
    pace: float
    wish_rate: float


# Above 60 lines: one system of forces, solved for the last tips, for these, and for the new wishes.
def answer(replica: Replica, sight: Sight, share: float, own: Own, dt: float) -> Answer:
    """Compute the forces of all hands in a period.

    Args:
        replica: Models after the last period.
        sight: Surface of the patches at the probe.
        share: Completed fraction of the move to the newest patch, 0 to 1.
        own: The own hand.
        dt: Time since the last period [s].
    """
    forces, wishes, weight, shift = [0.0], replica.wishes, 0.0, 0.0
    explained = wished = 0.0
    if own.k_h > 0.0:
        numbers = shown_numbers(replica, share)
        weight = numbers[0]
        C, most, without = _coupling(replica, numbers, weight, own, dt)
        wanted = [numbers[at(j)] for j in range(len(replica.news.partners))]
        old = wishes or wanted
        depth, before = [sight.depth + without], [sight.depth + without - own.moved_in]
        for wish, give in zip(old, replica.gives[1:], strict=True):
            depth.append(wish - give.y)
            before.append(wish - give.y + dt * give.v)
        forces = contact_forces(C, depth, most, replica.forces)
        stiff = stiffness(C, forces, most)
        least = 1.0 / C[0][0]
        if stiff[0] > _ROUNDING * max(least, own.max_stiffness):
            # The device cannot render this: take as much less of what the models answer.
            less = max(0.0, 1.0 - least / own.max_stiffness) / (1.0 - least / stiff[0])
            for k in range(1, len(depth)):
                C[0][k] *= less
            depth[0] -= (1.0 - less) * without
            before[0] -= (1.0 - less) * without
            without *= less
            forces = contact_forces(C, depth, most, forces)
            stiff = stiffness(C, forces, most)
        then, answered = contact_forces(C, before, most, forces), forces
        for k in range(1, len(depth)):
            explained -= C[0][k] * (answered[k] - then[k])
        further = [a - b for a, b in zip(wanted, old, strict=True)]
        # The models' own motion counts as far as the own motion may have made it: nothing is
        # explained to a hand at rest.
        at_once = max(0.0, stiff[0] * C[0][0] - 1.0) * own.moved_in
        most_moved = _ANSWERED * own.pace * dt
        explained = at_once + max(-most_moved, min(most_moved, explained - at_once))
        moved = (own.moved_in + explained) / C[0][0]
        if moved * explained <= 0.0:
            moved = 0.0
        elif abs(moved) > abs(explained) / C[0][0]:
            moved = explained / C[0][0]
        rate = own.wish_rate * dt
        changes = _changes(C, depth, forces, stiff, further, moved, rate)
        for left in range(_TRIES, 0, -1):
            tried = list(depth)
            for k, change in enumerate(changes, start=1):
                tried[k] += change
            forces, wished = contact_forces(C, tried, most, answered), 0.0
            for k in range(1, len(depth)):
                wished -= C[0][k] * (forces[k] - answered[k])
            allowed = C[0][0] * _allowed(wished, moved, rate)
            if abs(wished) <= allowed * _ABOUT:
                break
            # Hands came into contact or left it: less of all that is wanted, or nothing now.
            less = 0.5 * allowed / abs(wished) if left > 1 else 0.0
            changes = [change * less for change in changes]
            if left == 1:
                forces, wished = answered, 0.0
        wishes = [a + b for a, b in zip(old, changes, strict=True)]
        shift = without
        for k in range(1, len(depth)):
            shift -= C[0][k] * forces[k]
    step = replica.shift - shift if math.isnan(replica.step) else replica.step
    step *= max(0.0, 1.0 - dt / _FADE)
    shift += step
    by_others = add(sight.u_others, scale(sight.normal, shift))
    # The models answer the force that the hand has now, and not the one that the body carried.
    carried = lerp(sight.own_force, scale(sight.normal, forces[0]), weight)
    shown = Sight(sight.depth + shift, sight.normal, sight.c_ii, carried, by_others)
    return Answer(forces, wishes, shown, shift, step, explained, wished)


def _allowed(wished: float, moved: float, rate: float) -> float:
    """Return the largest change of the own force by what others want [N].

    Such a change may be as fast as the rate, and undo what the models answer to the own motion. To
    hold back that answer would be a delay in a passive body, which makes energy; so it is what the
    others want that is held back.

    Args:
        wished: Change of which only the sign counts.
        moved: Change of the own force that the models' answer explains [N].
        rate: Change in a period that needs no explanation [N].
    """
    return rate + max(0.0, -math.copysign(moved, moved * wished))


def _changes(
    C: list[list[float]],
    depth: list[float],
    forces: list[float],
    stiff: list[float],
    further: list[float],
    moved: float,
    rate: float,
) -> list[float]:
    """Return the changes of what partners want that are shown in this period [m].

    Args:
        C: Compliance between the contacts, shape (n, n) [m/N].
        depth: Depth of each hand below the surface without any force, shape (n,) [m].
        forces: Forces at these depths, shape (n,) [N].
        stiff: Change of the own force per change of each depth, shape (n,) [N/m].
        further: Changes until the wishes are those of the patch, shape (n - 1,) [m].
        moved: As for `_allowed` [N].
        rate: As for `_allowed` [N].
    """
    n = len(forces)
    effects, free, net = [0.0] * (n - 1), [0.0] * (n - 1), 0.0
    for k in range(1, n):
        change, effect = further[k - 1], stiff[k]
        if forces[k] <= 0.0 and change > 0.0:  # the way through the air is free
            gap = -depth[k]
            for j in range(n):
                gap += C[k][j] * forces[j]
            free[k - 1] = min(change, max(0.0, gap))
            effect = -C[0][k] / C[k][k] * max(stiff[0], 1.0 / C[0][0])
        effects[k - 1] = effect * (change - free[k - 1])
        net += effects[k - 1]
    left, cap, rest = _allowed(net, moved, rate), math.inf, n - 1
    for effect in sorted([abs(e) for e in effects]):  # the largest are cut, to one size
        if effect * rest > left:
            cap = left / rest
            break
        left, rest = left - effect, rest - 1
    return [
        free[k] + (further[k] - free[k]) * (cap / abs(e) if abs(e) > cap else 1.0)
        for k, e in enumerate(effects)
    ]


def _coupling(
    replica: Replica, numbers: list[float], weight: float, own: Own, dt: float
) -> tuple[list[list[float]], list[float], float]:
    """Return C, the largest forces, and the own depth without the forces of the surface, less it.

    The first row of C is weighted.
    """
    n, without, given = len(replica.gives), 0.0, max(own.given, 1e-3)
    C = [[0.0] * n for _ in range(n)]
    most = [min(own.most, replica.news.most) if own.given > 0.0 else 0.0]
    # At another place than that of the patch the own contact is as soft as the gain says; all its
    # compliances then differ, so that the matrix stays positive definite.
    C[0][0] = 1.0 / (own.k_h * given)
    there = min(1.0, math.sqrt(1.0 / (own.k_h * own.c_ii)))
    for j in range(n - 1):
        i, to = at(j), j + 1
        # A stiffer contact than this would let a period's force throw the model to and fro.
        C[to][to] = max(numbers[i + 3], dt * dt / replica.models[to].mass)
        for k in range(to):
            C[to][k] = C[k][to] = numbers[i + _NUMBERS + k]
        C[to][0] *= there
        C[0][to] = weight * C[to][0]
        without += C[0][to] * numbers[i + 1]
        most.append(numbers[i + 2])
    return C, most, without


def pace_of(replica: Replica, moved_in: float, dt: float) -> float:
    """Return the largest speed of the own hand of late [m/s].

    Args:
        replica: Models before the period.
        moved_in: Displacement into the surface in the period [m].
        dt: Duration [s].
    """
    kept = replica.pace * max(0.0, 1.0 - dt / _CALM)
    return max(kept, abs(moved_in) / dt) if dt > 0.0 else kept


def move(replica: Replica, answered: Answer, own: float, dt: float, pace: float = 0.0) -> Replica:
    """Return the models after a period.

    Args:
        replica: Models before it.
        answered: Forces in it.
        own: Normal force that the own hand got [N].
        dt: Duration [s].
        pace: As `pace_of` [m/s].
    """
    felt = [own, *answered.forces[1:]]
    felt += [0.0] * (len(replica.gives) - len(felt))
    return Replica(
        replica.news, replica.before, replica.after,
        _glided(replica.models, _told(replica.news), dt), _moved(replica, felt, dt), felt,
        answered.wishes, answered.explained, answered.shift, answered.step, pace,
    )  # fmt: skip


def left_alone(replica: Replica, dt: float) -> Replica:
    """Return the models after a period in which nobody pressed [s]."""
    felt = [0.0] * len(replica.gives)
    return Replica(
        replica.news, replica.before, replica.after, replica.models, _moved(replica, felt, dt),
        felt, replica.wishes,
    )  # fmt: skip


def _moved(replica: Replica, felt: list[float], dt: float) -> list[Give]:
    gives = list[Give]()
    for give, model, force in zip(replica.gives, replica.models, felt, strict=True):
        after = give_way(give, model, force, dt)
        # A server that describes a hand otherwise in each patch can make a model swing without
        # limits, and no sample can tell of it then.
        gives.append(after if abs(after.y) <= MAX_POSITION else Give())
    return gives
