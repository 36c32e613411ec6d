"""Search for the worst attack: draws at random, then climbs from those that were the worst."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeVar

Attack = TypeVar("Attack")

_CLIMBS: Final = 0.7  # share of later attacks that change one of the worst so far
_DRAWN: Final = 0.4  # share of attacks at the beginning that are drawn at random


class Found(NamedTuple):
    """The worst that was found in one measure.

    Fields:
        value: Value of the measure.
        attack: Attack that reached it.
    """

    value: float
    attack: Any


def search(
    play: Callable[[Attack], dict[str, float]],
    draw: Callable[[random.Random], Attack],
    alter: Callable[[Attack, random.Random], Attack],
    runs: int,
    r: random.Random,
) -> dict[str, Found]:
    """Return the worst of each measure, with its attack.

    Args:
        play: Play an attack; returns its measures by name.
        draw: Draw an attack.
        alter: Change an attack a little.
        runs: Number of attacks to play.
        r: Source of chance.
    """
    best: dict[str, Found] = {}
    attacks: dict[str, Attack] = {}
    for run in range(runs):
        if attacks and run > _DRAWN * runs and r.random() < _CLIMBS:
            attack = alter(r.choice(list(attacks.values())), r)
            if r.random() < 0.5:
                attack = alter(attack, r)
        else:
            attack = draw(r)
        for name, value in play(attack).items():
            if name not in best or value > best[name].value:
                best[name], attacks[name] = Found(value, attack), attack
    return best
