"""What the hands want that clients move models of, and whether models are used (science 3.15).

A client that moves models tells with each sample how far the model of its own hand has given way.
With it, a tick knows where the hand would be if no force moved it: what the hand wants. A patch
carries this of all other hands with their models, and the compliance between all contacts. The page
simulates its hand and tells how far that has given way, so that others can model it; it moves no
models itself.

Nothing is proved where a hand without a model presses, too, nor for friction, for bodies that
swing, creep or deform much, where hands turn each other's contacts, and where delays vary. There
the share of the models falls to zero, and each hand feels the forces in its patch's surface, which
have passed the room's lag (3.13).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cohaptic.control.delay import TOO_LONG
from cohaptic.control.hand_model import HandModel
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.partners import MAX_CARRIED, MAX_PARTNERS, Partner, Partners
from cohaptic.protocol.patch import MAX_COMPLIANCE, MIN_COMPLIANCE
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.world.applied_forces import MAX_INDENTATION
from cohaptic_server.world.partners.hand_estimate import STEP
from cohaptic_server.world.partners.learning import Learned, glide, hear, known, learn, unknown
from cohaptic_server.world.partners.plausible import (
    deflection_of,
    depth_of,
    doubt,
    lag_of,
    moved,
    strength,
)
from cohaptic_server.world.state import NEGLIGIBLE, TickTime, Touch
from cohaptic_server.world.users import Applied, Forbidden, Tracked, Wishes

# Rates at which the share of the models rises and falls [1/s]; it has to be gone when the hand that
# forbids models has been felt, and a change moves surfaces under fingers. Reasoned, not measured.
_RISE: Final = 1.0
_FALL: Final = 3.0
# s since models were last forbidden, before their share rises; a hand that taps beside them would
# move it for ever. As `planning.CALM_TIME`; reasoned, not measured.
_CALM: Final = 2.0
# s rms by which a loop's delay may differ from one that glides, in the last 4 s. A pause of 0.3 s,
# or one of 0.2 s in each second, stays below; with pauses of 0.6 s in each 2.5 s three hands side
# by side swung by 2 N (`python -m cohaptic_experiments.attacks links`, science 3.16).
STEADY: Final = 0.09
# Share of its square below which models may come back: pauses every few seconds would else let them
# come and go. A quarter is half of the rms; reasoned, not measured.
_STEADY_AGAIN: Final = 0.25
# s by which the patch that a hand has answered last is older than usual where its link counts as
# silent just now: a message or two that are late are no silence. As the client's least patience
# (`config.silent_after`); reasoned, not measured.
_SILENT: Final = 0.1
# Factor of the compliance of a contact. Two hands at the very same place would make the compliance
# between them singular. Far above the 6e-8 of 32 bits on the wire, and far below what is felt.
_APART: Final = 1.00001
# s from one window of any hand to the next: a window takes a few milliseconds of a tick, so that
# one tick of six is longer by them.
_LEARN_EVERY: Final = 0.1


NO_PARTNERS: Final[Mapping[int, Partners]] = {}


def moves_models(tracked: Tracked) -> bool:
    """Return whether any client moves models."""
    # Not by the property: this is asked in each tick of every room.
    return any(
        [touch.deflection is not None and touch.own_model is None for touch in tracked.touches]
    )


def has_model(touch: Touch) -> bool:
    """Return whether a hand's deflection is told, and its force follows from its depth alone."""
    return (
        touch.deflection is not None
        and touch.fresh
        and not touch.who.law.answers_own_dent
        and not touch.who.friction
        and touch.who.fixed_gains is None
    )


# Above 60 lines: whether models may be used, what is known of hands, and what they want by that.
def next_wishes(
    wishes: Wishes,
    tracked: Tracked,
    applied: Applied,
    height: Floats,
    C: Floats,
    stiffest: Floats,
    possible: bool,
    time: TickTime,
) -> Wishes:
    """Return what the hands want at the end of a tick.

    Args:
        wishes: Those of the last tick.
        tracked: Users with their newest samples.
        applied: Forces that the body carries.
        height: Height of each tip over its free surface, shape (n,) [m].
        C: Compliance between the contacts, shape (n, n) [m/N].
        stiffest: Largest gain of each user's law, shape (n,) [N/m].
        possible: Whether body and contacts allow models.
        time: Number, time and period of the tick.
    """
    touches = tracked.touches
    if not moves_models(tracked):
        return Wishes()
    begins = not wishes.hands
    pressing = applied.force > NEGLIGIBLE
    modelled = np.array([has_model(touch) for touch in touches], dtype=np.bool_)
    at, weight, forbidden = wishes.forbidden_at, wishes.weight, wishes.forbidden
    wavers = weight < 1.0 and forbidden.by == "link"
    reason = _forbidden(tracked, pressing, height, modelled, possible, wavers, time)
    if reason is not None:
        at, weight = time.now, 0.0 if begins else max(0.0, weight - _FALL * time.elapsed)
        forbidden = reason
    elif time.now - at >= _CALM:
        weight = min(1.0, weight + _RISE * time.elapsed)
    hands = {
        t.user: _heard(wishes.hands.get(t.user), t) for t in touches if t.deflection is not None
    }
    learned_at = wishes.learned_at
    if weight == 1.0 and time.now - learned_at >= _LEARN_EVERY:
        felt = C.copy()  # a hand also feels how soft its device is
        felt[np.diag_indices(len(C))] = np.maximum(C.diagonal(), 1.0 / stiffest)
        touching = pressing & modelled
        hands, learned_at = _learned(hands, tracked, felt, touching, time.now, learned_at)
    # Models press with nothing of a force along the surface. A hand that comes back after a
    # silence begins with no force, and so does its model.
    fractions = np.maximum(
        tracked.presence, 1e-9
    )  # by which a hand that has just come is felt less
    pushes: list[float] = (tracked.requested / fractions).tolist()
    forces = {t.user: push if t.fresh else 0.0 for t, push in zip(touches, pushes, strict=True)}
    hands = {user: glide(hand, forces[user], time.elapsed) for user, hand in hands.items()}
    models = {user: hand.model for user, hand in hands.items()}
    past = (*wishes.past[-math.ceil(TOO_LONG / time.period) :], (time.number, models))
    others = (C @ applied.force - C.diagonal() * applied.force).tolist()
    own = np.maximum(C.diagonal(), 1.0 / stiffest).tolist()
    intended: dict[int, float] = {}
    for i, (touch, has) in enumerate(zip(touches, modelled.tolist(), strict=True)):
        if not has:
            continue
        hand = hands[touch.user]
        depth, implausible = depth_of(touch, hand, -float(height[i]), own[i], pushes[i])
        if implausible:
            hands[touch.user] = hand = doubt(hand)
        # (3.15) q_j = x_j + y'_j; `depth` is below a surface that others' forces have moved
        wanted, late = others[i] + depth + deflection_of(touch, hand), lag_of(hand)
        # (3.15 c) q_j / (1 + s tau_j), with tau_j = late
        kept = math.exp(-time.elapsed / late) if late > 0.0 else 0.0
        before = wishes.intended.get(touch.user, wanted)
        intended[touch.user] = moved(before, wanted + kept * (before - wanted), time.elapsed)
    return Wishes(intended, hands, past, weight, at, forbidden, learned_at)


def _forbidden(
    tracked: Tracked,
    pressing: Mask,
    height: Floats,
    modelled: Mask,
    possible: bool,
    wavers: bool,
    time: TickTime,
) -> Forbidden | None:
    """Return the reason why models may not be used in a tick; None if they may."""
    if not possible:
        return Forbidden("object")
    rows: list[int] = np.flatnonzero(pressing & (tracked.settings[3] > 0.0)).tolist()
    users = [tracked.touches[row].user for row in rows]
    beside = [user for user, row in zip(users, rows, strict=True) if not modelled[row]]
    if beside:
        return Forbidden("hand", tuple(beside))
    if int(pressing.sum()) > MAX_PARTNERS + 1:
        return Forbidden("number")
    # A hand below the surface presses in the others' models, also while its client gives no force.
    deep = np.flatnonzero((pressing | (height < 0.0)) & (tracked.settings[3] > 0.0)).tolist()
    jumped = [
        tracked.touches[row].user
        for row in deep
        # What a hand wants that is told follows no force, so that nothing loops through its link.
        if tracked.touches[row].moves_models and _jumped(tracked, row, wavers, time)
    ]
    return Forbidden("link", tuple(jumped)) if jumped else None


def _jumped(tracked: Tracked, row: int, wavers: bool, time: TickTime) -> bool:
    """Return whether a hand's delay jumps again and again, and it is not silent just now.

    One that has fallen silent may be gone for good; if it comes back, its delay has jumped.
    """
    delay = tracked.delays[row]
    max_force = STEADY + 0.5 * time.period  # delays are counted in ticks
    if delay.unsteady <= max_force * max_force * (_STEADY_AGAIN if wavers else 1.0):
        return False
    late = (time.number - tracked.touches[row].tick) * time.period
    return late <= delay.glided + _SILENT + 1.5 * time.period


def _heard(learned: Learned | None, touch: Touch) -> Learned:
    if touch.own_model is not None:
        return known(learned, touch.user, touch.own_model)
    return hear(learned or unknown(touch.user), touch)


def _learned(
    hands: dict[int, Learned],
    tracked: Tracked,
    C: Floats,
    touching: Mask,
    now: float,
    learned_at: float,
) -> tuple[dict[int, Learned], float]:
    """Return the hands with one window taken in, and the time at which the last one was."""
    users = [touch.user for touch in tracked.touches]
    waiting = [user for user in users if user in hands and hands[user].ready(now)]
    changing = any([hand.reported and hand.model != hand.wanted[0] for hand in hands.values()])
    # Around a hand that changes, a window's contacts are those of no one moment.
    if changing or not waiting:
        return hands, learned_at
    user = min(waiting, key=lambda user: hands[user].due)
    rows = [i for i, other in enumerate(users) if other in hands]
    models = [hands[users[i]].model for i in rows]
    row = rows.index(users.index(user))
    try:
        one = learn(hands[user], C[np.ix_(rows, rows)], models, row, touching[rows], now)
    except (ValueError, ArithmeticError, np.linalg.LinAlgError):
        # Samples that no hand makes: their client is the only one to pay.
        one = replace(unknown(user), due=now + STEP)
    return {**hands, user: one}, now


def _model_at(wishes: Wishes, touch: Touch) -> HandModel:
    """Return the model of a hand whose displacement its newest sample tells."""
    if touch.own_model is not None:  # the deflection is not one of a model that moves
        return wishes.hands[touch.user].model
    first = wishes.past[0][0]
    then = wishes.past[min(max(0, touch.tick - first), len(wishes.past) - 1)][1]
    return then.get(touch.user) or wishes.hands[touch.user].model


def held_beside(tracked: Tracked, wishes: Wishes, pressing: Mask, C: Floats) -> Floats:
    """Return how much the tips of others stiffen each contact while they cannot move, (n,) [m/N].

    It is C_ii - 1 / (C^-1)_ii over all hands with models that press, in the share of the models,
    and 0 for a hand whose client moves none. A device renders K where the gain of its law is at
    most 1 / (1 / K + this).
    """
    beside = np.zeros(len(C))
    known = [touch.user in wishes.intended for touch in tracked.touches]
    rows = np.flatnonzero(pressing & np.array(known, dtype=np.bool_))
    if len(rows) > 1:
        part = C[np.ix_(rows, rows)]
        own = part.diagonal().copy()
        part[np.diag_indices(len(rows))] *= _APART
        held = np.maximum(0.0, own - 1.0 / np.linalg.inv(part).diagonal())
        own_models = [tracked.touches[row].moves_models for row in rows.tolist()]
        beside[rows] = wishes.weight * np.where(own_models, held, 0.0)
    return beside


def partners_of(
    wishes: Wishes,
    tracked: Tracked,
    applied: Applied,
    near: Floats,
    C: Floats,
    stiffest: Floats,
    size: float,
) -> dict[int, Partners]:
    """Return the partners for the patch of each user whose client moves models.

    Args:
        wishes: What the hands want, at the end of this tick.
        tracked: Users with their newest samples.
        applied: Forces that the body carries.
        near: Weight of each user as a neighbour, 0 to 1, shape (n,).
        C: Compliance between the contacts, shape (n, n) [m/N].
        stiffest: Largest gain of each user's law, shape (n,) [N/m].
        size: Size of the body [m].
    """
    touches, hands = tracked.touches, wishes.hands
    # The pressing ones first, where there are more than a patch can carry.
    order: Sequence[int] = np.argsort(-near - applied.force, kind="stable").tolist()
    rows = [i for i in order if near[i] > 0.0 and touches[i].user in wishes.intended]
    models = {i: _model_at(wishes, touches[i]) for i in rows}
    own = np.maximum(C.diagonal(), 1.0 / stiffest)
    own = np.clip(_APART * own, MIN_COMPLIANCE, MAX_COMPLIANCE).tolist()
    force = np.clip(applied.force, 0.0, MAX_CARRIED).tolist()
    # No more than the body takes of one hand at its contact.
    deepest = MAX_INDENTATION * size / np.maximum(C.diagonal(), MIN_COMPLIANCE)
    max_force = (applied.presence * np.minimum(tracked.settings[0], deepest)).tolist()
    between: list[list[float]] = np.clip(C, -MAX_POSITION, MAX_POSITION).tolist()
    farthest = 2.0 * MAX_POSITION

    def partner(i: int, j: int, earlier: Sequence[int]) -> Partner:
        wanted = min(farthest, max(-farthest, wishes.intended[touches[j].user]))
        row = (between[i][j], *(between[j][h] for h in earlier))
        hand = hands[touches[j].user]
        deflection, max_of = deflection_of(touches[j], hand), min(max_force[j], strength(hand))
        return Partner(
            touches[j].user, models[j], wanted, deflection, force[j], max_of, own[j], row
        )

    found: dict[int, Partners] = {}
    for i, touch in enumerate(touches):
        if not touch.moves_models:
            continue
        if touch.user not in wishes.intended:  # it feels the surface as it is
            found[touch.user] = Partners(0.0, max_force[i], hands[touch.user].model, ())
            continue
        # In the order of their rows, so that a patch mostly has the same partners as the last one.
        others = sorted([j for j in rows if j != i][:MAX_PARTNERS])
        found[touch.user] = Partners(
            wishes.weight,
            max_force[i],
            hands[touch.user].model,
            tuple(partner(i, j, others[:k]) for k, j in enumerate(others)),
        )
    return found
