"""The other hands at this end: models of them answer this hand at the haptic rate (science 3.15).

A patch's surface contains the forces that the others had one way ago. They are replaced by those
that models of the others have now, which give way to this hand at once. From the others only comes
what they want: the depth that each would have if no force moved it. This module is the memory of
the models, and `answer.py` what they answer in a period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from cohaptic.control.geometry import Sight
from cohaptic.control.hand_model import Deflection, HandModel, deflect
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.partners import Partners

NUMBERS: Final = 4  # of a partner in `numbers_of` that come before its compliances
# s after which a motion of the own hand explains nothing any more. A model's answer to a motion is
# late by a quarter of its swing at most, which is 25 ms for a hand that swings at 10 Hz.
REMEMBERED: Final = 0.03
# 1/s; largest change of a model in relation to itself: twice as fast as an honest server's estimate
# (`RATE_IN_NEED`), and as fast as a hand that is told (`TOLD_RATE`).
_MODEL_RATE: Final = 1.0


class Recent(NamedTuple):
    """Speed of the own hand into or out of the surface within the last `REMEMBERED`.

    Fields:
        speed: Largest speed; an earlier one counts along a line to zero [m/s].
        peak: Speed from which that line falls [m/s].
    """

    speed: float = 0.0
    peak: float = 0.0


NOT_MOVED: Final = Recent()


@dataclass(init=False)
class Replica:
    """The models in one period.

    Fields:
        news: Partners of the newest patch.
        before: Numbers that were shown when that patch came, in the order of `numbers_of`.
        after: Numbers that are shown when the move to that patch is complete.
        bends: Of what each partner wants on the way, beyond a straight line [m]; empty for none.
        models: Model of the own hand, and of each partner, as they move.
        deflections: Give of the own hand, and of each partner.
        forces: Force of the own hand, and of each partner, in the last period [N].
        wishes: What each partner wants, as it was shown in the last period [m]; empty before.
        model_change: As in `Answer`, of the last period [m].
        shift: Displacement of the surface by the models in the last period [m].
        step: Part of it that fades, since partners came or went [m]; NaN in the first period after
            they did.
        recent: Speed of the own hand into or out of the surface.
    """

    news: Final[Partners]
    before: Final[list[float]]
    after: Final[list[float]]
    bends: Final[list[float]]
    models: Final[list[HandModel]]
    deflections: Final[list[Deflection]]
    forces: Final[list[float]]
    wishes: Final[list[float]]
    model_change: Final[float]
    shift: Final[float]
    step: Final[float]
    recent: Final[Recent]

    def __init__(
        self,
        news: Partners,
        before: list[float],
        after: list[float],
        bends: list[float],
        models: list[HandModel],
        deflections: list[Deflection],
        forces: list[float],
        wishes: list[float],
        model_change: float = 0.0,
        shift: float = 0.0,
        step: float = 0.0,
        recent: Recent = NOT_MOVED,
    ) -> None:
        self.news = news
        self.before = before
        self.after = after
        self.bends = bends
        self.models = models
        self.deflections = deflections
        self.forces = forces
        self.wishes = wishes
        self.model_change = model_change
        self.shift = shift
        self.step = step
        self.recent = recent


def numbers_of(partners: Partners) -> list[float]:
    """Return the numbers that move from patch to patch: the weight, and those of each partner.

    They are what the partner wants, its force in the surface, its largest force and its
    compliances.
    """
    numbers = [partners.weight]
    for p in partners.partners:
        numbers.append(p.intended)
        numbers.append(p.force)
        numbers.append(p.max_force)
        numbers.append(p.c_jj)
        numbers += p.coupled
    return numbers


def place_of(j: int) -> int:
    """Return the place of the first number of partner `j` in `numbers_of`."""
    return 1 + NUMBERS * j + j * (j + 1) // 2


def fraction_answered(replica: Replica | None, trusted: float) -> float:
    """Return the share of what others do that models answer at once, 0 to 1.

    Args:
        replica: Models; None without any.
        trusted: Share of them that is trusted, 0 to 1.
    """
    if replica is None or not replica.news.partners:
        return 0.0
    return trusted * replica.news.weight


def follow(replica: Replica | None, news: Partners, fraction: float, way: float = 0.0) -> Replica:
    """Return the models with the partners of a new patch.

    Args:
        replica: Models after the last period; None before the first patch with partners.
        news: Partners of the new patch.
        fraction: Completed fraction of the move to the patch before, 0 to 1.
        way: Duration of that move over that of the move to the new patch; 0 to move along lines.
    """
    after = numbers_of(news)
    if replica is None:
        deflections = [Deflection()] + [Deflection(p.deflection) for p in news.partners]
        forces = [0.0] + [p.force for p in news.partners]
        return Replica(
            news, after, after, [], _report(news), deflections, forces, [], step=math.nan
        )
    if replica.news.users == news.users:
        bends = list[float]()
        if fraction >= 1.0 and 0.0 < way < math.inf:
            bends = [
                _bend(
                    replica.before[place_of(j)], replica.after[place_of(j)], after[place_of(j)], way
                )
                for j in range(len(news.partners))
            ]
        before = shown_numbers(replica, fraction)
        return replace(replica, news=news, before=before, after=after, bends=bends)
    # A hand that comes begins where its patch says. What this changes in the surface fades.
    old = {user: j + 1 for j, user in enumerate(replica.news.users)}
    deflections, forces, wishes = [replica.deflections[0]], [replica.forces[0]], list[float]()
    models = [replica.models[0]]
    for p in news.partners:
        i = old.get(p.user, 0)
        wishes.append(replica.wishes[i - 1] if i and replica.wishes else p.intended)
        models.append(replica.models[i] if i else p.model)
        deflections.append(replica.deflections[i] if i else Deflection(p.deflection))
        forces.append(replica.forces[i] if i else p.force)
    return Replica(
        news,
        after,
        after,
        [],
        models,
        deflections,
        forces,
        wishes,
        0.0,
        replica.shift,
        math.nan,
        replica.recent,
    )


def _bend(then: float, before: float, after: float, way: float) -> float:
    """Return how much a parabola through three values lies beyond a line through the last two.

    Lines between ticks that come late leave a kink that a finger feels in what moves at 2 Hz. A
    bend is at most as large as the steps, so that no lie is made larger than it is.

    Args:
        then, before, after: The values [m].
        way: Time between the first two, over that between the last two.
    """
    bend = (then - before + way * (after - before)) / (way * (way + 1.0))
    limit = abs(after - before)
    return max(-limit, min(limit, bend))


def _report(news: Partners) -> list[HandModel]:
    """Return the model of the own hand, and of each partner, as a patch says them."""
    return [news.model, *[p.model for p in news.partners]]


def _glided(models: list[HandModel], reported: list[HandModel], dt: float) -> list[HandModel]:
    """Return models on their way to those that a patch says, after a time [s].

    A server may say anything: a model that jumps throws its hand, and so a force.
    """
    limit = _MODEL_RATE * dt
    return [
        HandModel(
            now.mass + max(-limit, min(limit, then.mass / now.mass - 1.0)) * now.mass,
            now.damping + max(-limit, min(limit, then.damping / now.damping - 1.0)) * now.damping,
            now.stiffness
            + max(-limit, min(limit, then.stiffness / now.stiffness - 1.0)) * now.stiffness,
        )
        for now, then in zip(models, reported, strict=True)
    ]


def shown_numbers(replica: Replica, fraction: float) -> list[float]:
    """Return the numbers of `numbers_of` in this period."""
    if fraction >= 1.0:
        return replica.after
    numbers = [a + fraction * (b - a) for a, b in zip(replica.before, replica.after, strict=True)]
    for j, bend in enumerate(replica.bends):
        numbers[place_of(j)] += fraction * (fraction - 1.0) * bend
    return numbers


class Answer(NamedTuple):
    """Forces of all hands in one period.

    Fields:
        forces: Force of the own hand, and of each partner [N].
        wishes: What each partner wants, as it is shown [m].
        sight: Surface with the models' forces in place of those that it came with.
        shift: Displacement of the surface by the models [m].
        step: Part of `shift` that fades [m].
        model_change: Change of `shift` since the last period by the motions of the own hand and of
            the models [m].
        wished: Change of `shift` since the last period by what partners want [m].
    """

    forces: list[float]
    wishes: list[float]
    sight: Sight
    shift: float
    step: float
    model_change: float
    wished: float


def recent_speed(recent: Recent, moved_in: float, dt: float) -> Recent:
    """Return the speed of the own hand of late, after a period.

    Args:
        recent: The same before it.
        moved_in: Displacement into the surface in the period [m].
        dt: Duration [s].
    """
    if dt <= 0.0:
        return recent
    speed, kept = abs(moved_in) / dt, recent.speed - recent.peak * dt / REMEMBERED
    if speed >= kept:
        return Recent(speed, speed)
    return Recent(kept, recent.peak)


def move(
    replica: Replica,
    answered: Answer,
    own: float,
    dt: float,
    recent: Recent = NOT_MOVED,
) -> Replica:
    """Return the models after a period.

    Args:
        replica: Models before it.
        answered: Forces in it.
        own: Normal force that the own hand got [N].
        dt: Duration [s].
        recent: Speed of the own hand.
    """
    felt = [own, *answered.forces[1:]]
    felt += [0.0] * (len(replica.deflections) - len(felt))
    return Replica(
        replica.news, replica.before, replica.after, replica.bends,
        _glided(replica.models, _report(replica.news), dt), _moved(replica, felt, dt), felt,
        answered.wishes, answered.model_change, answered.shift, answered.step, recent,
    )  # fmt: skip


def left_alone(replica: Replica, dt: float) -> Replica:
    """Return the models after a period in which nobody pressed [s]."""
    felt = [0.0] * len(replica.deflections)
    return Replica(
        replica.news, replica.before, replica.after, replica.bends, replica.models,
        _moved(replica, felt, dt), felt, replica.wishes,
    )  # fmt: skip


def _moved(replica: Replica, felt: list[float], dt: float) -> list[Deflection]:
    deflections = list[Deflection]()
    for deflection, model, force in zip(replica.deflections, replica.models, felt, strict=True):
        after = deflect(deflection, model, force, dt)
        # A server that describes a hand otherwise in each patch can make a model swing without
        # limits, and no sample can tell of it then.
        deflections.append(after if abs(after.y) <= MAX_POSITION else Deflection())
    return deflections
