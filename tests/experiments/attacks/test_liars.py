"""Co-users who lie about themselves, against hands that rest and move models of them."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from cohaptic.control.hand_model import HandModel
from cohaptic.protocol.partners import LIGHTEST
from cohaptic_client.loop.safety import BACKSTOP, EXTERNAL_RATE
from cohaptic_experiments.attacks.liars import Liar, Reported, Stage, alter, attacked, draw
from cohaptic_experiments.attacks.victims import PERIOD
from cohaptic_server.bodies.balloon.balloon import Balloon

STEP = BACKSTOP * EXTERNAL_RATE * PERIOD  # N
# The worst that was found against a light hand before the client had an account of energy: 34 mm of
# swing, 32 mJ, and 402 mJ of work in 2.5 s. It takes turns between just outside and deep inside.
WORST = Liar(
    face="page",
    beside=0.12,
    max_force=100.0,
    max_stiffness=100.0,
    damping=8.0,
    friction=False,
    a=Reported(-0.001, 100.0, 5.0, -0.02, LIGHTEST, anchored=False),
    b=Reported(5.0, 10.0, 0.0, 0.2, HandModel(0.0406, 0.56, 252.0), anchored=True),
    turn="chance",
    half=17,
    each=16,
    ticks="true",
    times="jump",
    rejoins=0,
    laws=0,
)


@pytest.fixture(scope="module")
def stage(balloon: Balloon) -> Stage:
    return Stage(balloon, ("clamped", "light"))


def test_the_worst_liar_of_old_moves_no_light_hand_far(stage: Stage) -> None:
    """Without models the same search found 9 mm against it."""
    for seed in range(2):
        worst = attacked(stage, replace(WORST, half=17 + seed))["light"]
        assert worst.swing <= 1.2 * 9.0 + 2.0
        assert worst.kinetic <= 4.0
        assert worst.work <= 40.0


def test_no_liar_moves_a_clamped_tip_faster_than_others_may(stage: Stage) -> None:
    r, liar = random.Random(5), WORST
    for _ in range(6):
        liar = alter(liar, r) if r.random() < 0.5 else draw(r)
        harm = attacked(stage, liar, 1.5)["clamped"]
        assert harm.step <= STEP + 1e-9
        assert harm.climb <= 20 * STEP + 1e-9
