"""What models of the other hands answer in one haptic period (science 3.15).

The forces of all hands are solved for together. What models answer to the own motion is free; what
others want is held back, so that it changes the own force no faster than a surface may.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from cohaptic.control.geometry import Sight
from cohaptic.control.hand_model import contact_forces, stiffness
from cohaptic.vec import add, lerp, scale
from cohaptic_client.loop.replica import NUMBERS, Answer, Replica, place_of, shown_numbers
from cohaptic_client.loop.safety import EXTERNAL_RATE

# s in which a step fades that partners make when they come, go or lose their models. A force of
# 2 N then changes by 0.02 N a millisecond at first, the slew's limit.
_FADE: Final = 0.1
# N/s by which what others want may change the own force. What is left of the slew's rate, 3 N/s, is
# for changes of gain and compliance. A fade of the safety layer or of the law takes 10 N/s; half of
# what it leaves stays for others. Reasoned, not measured.
WISH_RATE: Final = 0.85 * EXTERNAL_RATE
WISH_RATE_IN_FADES: Final = 0.25 * EXTERNAL_RATE
# Speed of a model over the largest speed of the own hand of late: a light hand in resonance. The 2
# is reasoned, not measured; what a liar can do with it was (docs/safety.md, "A hand that moves").
_ANSWERED: Final = 2.0
# Tries to find how much of what others want is within its limit. Each aims at half of the limit, so
# that the second is within it where no hand comes or leaves. Reasoned, not measured.
_TRIES: Final = 3
# Factor; alone, a hand's own stiffness is that of its law but for the rounding of doubles.
_ROUNDING: Final = 1.0 + 1e-7
# Factor within which that is found: a hundredth of 17 N/s is little of the 3 N/s that `WISH_RATE`
# leaves. Reasoned, not measured.
_ABOUT: Final = 1.01


class OwnHand(NamedTuple):
    """The own hand in one period.

    Fields:
        k_h: Gain of its law [N/m].
        c_ii: Compliance of its contact in the newest patch [m/N].
        max_force: Largest force on it [N].
        given: Share of the law's force that the safety layer gives, 0 to 1.
        max_stiffness: Largest stiffness that its device renders stably [N/m].
        moved_in: Displacement into the surface since the last period [m].
        speed: Largest speed into or out of the surface of late [m/s].
        wish_rate: Rate at which others may change the own force [N/s].
        trusted: Share of the models that is trusted, 0 to 1.
    """

    k_h: float
    c_ii: float
    max_force: float
    given: float
    max_stiffness: float
    moved_in: float
    speed: float
    wish_rate: float
    trusted: float = 1.0


# Above 60 lines: one system of forces, solved for the last tips, for these, and for the new wishes.
def answer(replica: Replica, sight: Sight, fraction: float, own: OwnHand, dt: float) -> Answer:
    """Compute the forces of all hands in a period.

    Args:
        replica: Models after the last period.
        sight: Surface of the patches at the probe.
        fraction: Completed fraction of the move to the newest patch, 0 to 1.
        own: The own hand.
        dt: Time since the last period [s].
    """
    if not replica.news.partners and replica.shift == 0.0:  # alone: the surface as it is
        return Answer([0.0], [], sight, 0.0, 0.0, 0.0, 0.0)
    forces, wishes, weight, shift = [0.0], replica.wishes, 0.0, 0.0
    model_change = wished = 0.0
    if own.k_h > 0.0:
        numbers = shown_numbers(replica, fraction)
        weight = own.trusted * numbers[0]
        C, max_force, without = _coupling(replica, numbers, weight, own, dt)
        wanted = [numbers[place_of(j)] for j in range(len(replica.news.partners))]
        old = wishes or wanted
        depth, before = [sight.depth + without], [sight.depth + without - own.moved_in]
        # (3.15) x_j = q_j - y'_j, with q_j = wish and y'_j = deflection.y; the own x as it is
        for wish, deflection in zip(old, replica.deflections[1:], strict=True):
            depth.append(wish - deflection.y)
            before.append(wish - deflection.y + dt * deflection.v)
        # (3.15) C f = x, where hands press
        forces = contact_forces(C, depth, max_force, replica.forces)
        stiff = stiffness(C, forces, max_force)
        least = 1.0 / C[0][0]
        if stiff[0] > _ROUNDING * max(least, own.max_stiffness):
            # The device cannot render this: take as much less of what the models answer.
            less = max(0.0, 1.0 - least / own.max_stiffness) / (1.0 - least / stiff[0])
            for k in range(1, len(depth)):
                C[0][k] *= less
            depth[0] -= (1.0 - less) * without
            before[0] -= (1.0 - less) * without
            without *= less
            forces = contact_forces(C, depth, max_force, forces)
            stiff = stiffness(C, forces, max_force)
        then = contact_forces(C, before, max_force, forces)
        for k in range(1, len(depth)):
            model_change -= C[0][k] * (forces[k] - then[k])
        further = [a - b for a, b in zip(wanted, old, strict=True)]
        # The models' own motion counts as far as the own motion may have made it: nothing is
        # explained to a hand at rest.
        at_once = max(0.0, stiff[0] * C[0][0] - 1.0) * own.moved_in
        max_moved = _ANSWERED * own.speed * dt  # (3.15, Held back)
        model_change = at_once + max(-max_moved, min(max_moved, model_change - at_once))
        moved = (own.moved_in + model_change) / C[0][0]
        if moved * model_change <= 0.0:
            moved = 0.0
        elif abs(moved) > abs(model_change) / C[0][0]:
            moved = model_change / C[0][0]
        changes = _changes(C, depth, forces, stiff, further, moved, own.wish_rate * dt)
        changes, forces, wished = _within(
            C, depth, max_force, forces, changes, moved, own.wish_rate * dt
        )
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
    return Answer(forces, wishes, shown, shift, step, model_change, wished)


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
    # (3.15, Held back) 17 N/s, and as much as it undoes of what own motion and models explain
    return rate + max(0.0, -math.copysign(moved, moved * wished))


def _within(
    C: list[list[float]],
    depth: list[float],
    max_force: list[float],
    answered: list[float],
    changes: list[float],
    moved: float,
    rate: float,
) -> tuple[list[float], list[float], float]:
    """Return changes of wishes within their limit, the forces then, and the change of the surface.

    Hands that come into contact or leave it may make more of changes than `_changes` has reckoned
    with: then less of all of them is shown, or nothing in this period.

    Args:
        C: As for `_changes`.
        depth: As for `_changes`.
        max_force: Largest force of each hand, shape (n,) [N].
        answered: Forces before these changes, shape (n,) [N].
        changes: From `_changes`, shape (n - 1,) [m].
        moved: As for `_allowed` [N].
        rate: As for `_allowed` [N].
    """
    for _ in range(_TRIES):
        tried = list(depth)
        for k, change in enumerate(changes, start=1):
            tried[k] += change
        forces, wished = contact_forces(C, tried, max_force, answered), 0.0
        for k in range(1, len(depth)):
            wished -= C[0][k] * (forces[k] - answered[k])
        allowed = C[0][0] * _allowed(wished, moved, rate)
        if abs(wished) <= allowed * _ABOUT:
            return changes, forces, wished
        less = 0.5 * allowed / abs(wished)
        changes = [change * less for change in changes]
    return [0.0] * len(changes), answered, 0.0


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
    replica: Replica, numbers: list[float], weight: float, own: OwnHand, dt: float
) -> tuple[list[list[float]], list[float], float]:
    """Return C, the largest forces, and the own depth without the forces of the surface, less it.

    The first row of C is weighted.
    """
    n, without, given = len(replica.deflections), 0.0, max(own.given, 1e-3)
    C = [[0.0] * n for _ in range(n)]
    max_force = [min(own.max_force, replica.news.max_force) if own.given > 0.0 else 0.0]
    # At another place than that of the patch the own contact is as soft as the gain says; all its
    # compliances then differ, so that the matrix stays positive definite.
    C[0][0] = 1.0 / (own.k_h * given)
    there = min(1.0, math.sqrt(1.0 / (own.k_h * own.c_ii)))
    for j in range(n - 1):
        i, to = place_of(j), j + 1
        # A stiffer contact than this would let a period's force throw the model to and fro.
        C[to][to] = max(numbers[i + 3], dt * dt / replica.models[to].mass)
        for k in range(to):
            C[to][k] = C[k][to] = numbers[i + NUMBERS + k]
        C[to][0] *= there
        C[0][to] = weight * C[to][0]
        without += C[0][to] * numbers[i + 1]
        max_force.append(numbers[i + 2])
    return C, max_force, without
