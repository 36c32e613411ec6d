"""Predicts the forces that hands are about to have from their samples (science 3.13).

Each tick chooses at its end the part of the coupling to be anticipated (`planning.py`). The next
tick multiplies this part with the change of the forces: from those that the body carried when the
patches were made that samples answer, to those in the samples.
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
    """Return the forces that the body carried in ticks that samples may still answer, oldest first.

    Args:
        past: Forces of the ticks before this one, oldest first.
        tick: Number of this tick.
        ticks: Number of ticks that are kept.
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
    """Return the forces that hands will have when each has felt the newest forces of the others.

    Args:
        plan: Plan from the end of the last tick.
        past: Forces that the body carried, oldest first.
        normal: Normal force of each user, within the limits of its contact, shape (n,) [N].
        tangential: Tangential force of each user, shape (n, 3) [N].

    Returns:
        Normal and tangential forces; only those of users in the plan who press are changed.
    """
    numbers = _numbers(tracked)
    rows = np.flatnonzero((numbers[:, None] == plan.users).any(axis=1))  # few: `isin` takes longer
    if not past or not len(rows) or not np.array_equal(numbers[rows], plan.users):
        return normal, tangential  # a user of the plan has left: this tick ends with a new plan
    frames = tracked.contacts.frames[rows]
    answers = frames[:, 2] * normal[rows, None] + tangential[rows]
    f = np.einsum("li,li->l", answers[plan.owner], plan.axes)
    carried = _carried(plan, past, [tracked.touches[i].tick for i in rows.tolist()])
    difference = np.einsum("lk,lk->l", plan.part, f - carried[plan.owner])
    change = (plan.solve @ -difference)[:, None] * plan.axes
    moved = np.add.reduceat(change, np.searchsorted(plan.owner, np.arange(len(rows))), axis=0)
    # A user without force is about to touch or has let go: anticipation must not make it press.
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
    """Forces of all loads in the tick of the patch that each user answers, shape (k, l) [N]."""
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
