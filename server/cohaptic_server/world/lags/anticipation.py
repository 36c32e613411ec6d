"""Forces that hands are about to feel, from those that they have answered with (science 3.13).

The end of a tick finds which part of the coupling is anticipated (`planning.py`); the next
tick takes it, and what the body carried when the patches were made that the samples answer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.state import Anticipation, Carried
from cohaptic_server.world.users import Applied, Tracked


def remember(
    past: tuple[Carried, ...], tick: int, tracked: Tracked, applied: Applied, ticks: int
) -> tuple[Carried, ...]:
    """What the body carried in the ticks that samples may still answer, oldest first.

    Args:
        past: Before this tick.
        tick: Its number.
        tracked: Its users.
        applied: The forces that the body carries of them.
        ticks: How many are kept.
    """
    forces = tracked.contacts.normals * applied.force[:, None] + applied.tangential
    return (*past[1 - ticks :], Carried(tick, _numbers(tracked), forces))


def anticipate(
    plan: Anticipation,
    past: Sequence[Carried],
    tracked: Tracked,
    normal: Floats,
    tangential: Floats,
) -> tuple[Floats, Floats]:
    """The forces that hands will have once they feel all others' newest ones.

    Args:
        plan: From the end of the last tick.
        past: What the body carried, oldest first.
        tracked: Users of this tick.
        normal: Force of each user, within the limits of its contact, shape (n,) [N].
        tangential: Along the surface, shape (n, 3) [N].

    Returns:
        Both, changed for those who touch and take part.
    """
    numbers = _numbers(tracked)
    rows = np.flatnonzero((numbers[:, None] == plan.users).any(axis=1))  # few: `isin` takes longer
    if not past or not len(rows) or not np.array_equal(numbers[rows], plan.users):
        return normal, tangential  # somebody has left: the end of this tick knows of it
    frames = tracked.contacts.frames[rows]
    answers = frames[:, 2] * normal[rows, None] + tangential[rows]
    f = np.einsum("li,li->l", answers[plan.owner], plan.axes)
    carried = _carried(plan, past, [tracked.touches[i].tick for i in rows.tolist()])
    difference = np.einsum("lk,lk->l", plan.part, f - carried[plan.owner])
    change = (plan.solve @ -difference)[:, None] * plan.axes
    moved = np.add.reduceat(change, np.searchsorted(plan.owner, np.arange(len(rows))), axis=0)
    # Who has no force is about to touch or has let go, and is not made to press.
    moved *= (normal[rows] > 0.0)[:, None]
    push = np.einsum("ij,ij->i", moved, frames[:, 2])
    ahead, along = normal.copy(), tangential
    ahead[rows] = np.minimum(tracked.settings[0, rows], np.maximum(0.0, ahead[rows] + push))
    if tracked.rough:
        along = tangential.copy()
        rough = np.isin(rows, tracked.rough)
        aside = moved - push[:, None] * frames[:, 2]
        along[rows[rough]] += aside[rough]
    return ahead, along


def _carried(plan: Anticipation, past: Sequence[Carried], ticks: Sequence[int]) -> Floats:
    """Forces of all loads when the patch was made that each user answers, shape (k, l) [N]."""
    forces = np.empty((len(ticks), len(plan.owner)))
    newest, oldest = past[-1].tick, past[0].tick
    answered = np.array(ticks)
    for tick in set(ticks):
        then = past[min(max(tick, oldest), newest) - oldest]
        along = np.einsum("li,li->l", then.of(plan.users)[plan.owner], plan.axes)
        forces[answered == tick] = along
    return forces


def _numbers(tracked: Tracked) -> Ints:
    return np.array([touch.user for touch in tracked.touches], dtype=np.int64)
