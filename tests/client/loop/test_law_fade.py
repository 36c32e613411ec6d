from __future__ import annotations

import itertools
from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.geometry import Sight
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains, LawSettings
from cohaptic.vec import norm
from cohaptic_client.loop.law_fade import (
    LAW_FADE_FRACTION_RATE,
    LawFade,
    Running,
    run,
    switch,
)
from cohaptic_client.loop.safety import EXTERNAL_RATE
from tests.client.loop.test_moving_surfaces import Held
from tests.client.plane import PLANE
from tests.examples_of_laws import examples
from tests.strategies import vectors

T = 0.001  # s
SETTINGS = LawSettings()
laws = st.sampled_from(Law)
gains = st.floats(10.0, 1000.0).map(Gains)
sights = st.builds(
    Sight,
    st.floats(-0.01, 0.03),
    st.just((0.0, 0.0, 1.0)),
    st.floats(1e-3, 0.02),
    st.floats(0.0, 5.0).map(lambda f: (0.0, 0.3 * f, f)),
    vectors(0.01),
)


def forces(fade: LawFade, sight: Sight, periods: int) -> tuple[LawFade, list[float]]:
    seen = list[float]()
    for _ in range(periods):
        fade, force = run(fade, sight, T, SETTINGS)
        seen.append(force.normal_force)
    return fade, seen


@given(st.lists(st.tuples(laws, gains, st.integers(1, 500)), min_size=2, max_size=5), sights)
@settings(max_examples=examples(60), deadline=None)
def test_whatever_follows_whatever_the_force_moves_by_one_percent(
    changes: list[tuple[Law, Gains, int]], sight: Sight
) -> None:
    """Also in the middle of another change; a large one by no more than others may move it."""
    law, own, periods = changes[0]
    fade, seen = forces(LawFade(Running(law, own)), sight, periods)
    for law, own, periods in changes[1:]:
        fade = switch(fade, law, own)
        fade, more = forces(fade, sight, periods)
        seen += more
    for a, b in itertools.pairwise(seen):
        assert abs(b - a) <= min(EXTERNAL_RATE, LAW_FADE_FRACTION_RATE * max(a, b, 0.05)) * T * 1.01


@given(laws, laws, gains, gains, sights)
@settings(deadline=None)
def test_a_change_ends_at_the_new_law(
    first: Law, second: Law, own: Gains, other: Gains, sight: Sight
) -> None:
    fade, seen = forces(switch(LawFade(Running(first, own)), second, other), sight, 4000)
    assert fade.before is None
    assert fade.now.law is second
    _, alone = forces(LawFade(Running(second, other if second is not first else own)), sight, 1)
    assert abs(seen[-1] - alone[0]) < 1e-9


@given(gains, gains, sights, st.integers(1, 250))
def test_the_way_back_begins_where_the_change_stood(
    own: Gains, other: Gains, sight: Sight, periods: int
) -> None:
    fade = switch(LawFade(Running(Law.PREDICTIVE, own)), Law.PROPORTIONAL, other)
    fade, _ = forces(fade, sight, periods)
    if fade.before is not None:
        assert switch(fade, Law.PI, other) is fade
        back = switch(fade, Law.PREDICTIVE, other)
        assert (back.now, back.fraction) == (fade.before, 1.0 - fade.fraction)


def test_a_stiff_law_that_goes_does_not_drive_the_friction() -> None:
    """Its gain counts while it fades: friction that came back through it would grow without end."""
    skewed = Compliance3(xx=0.003, yy=0.005, zz=0.004, xy=0.001, xz=0.001, yz=-0.001)
    reported = [replace(PLANE, law=Law.PROPORTIONAL, c_ii=0.004, k_h=8000.0, compliance=skewed)]
    hand = Held(lambda _: reported[0], depth=0.001, device=8000.0, friction=2.0)
    for k in range(20):
        hand.go((5e-5 * k, 0.0, -0.001))
    reported[0] = replace(reported[0], law=Law.PREDICTIVE, k_h=250.0)
    for _ in range(300):
        output = hand.go((1e-3, 0.0, -0.001))
        # What the friction's shift adds to the depth is bounded by that of the depth itself.
        assert norm(hand.state.friction.force) <= 2.0 * 2.0 * 8000.0 * 0.001
        assert norm(output.force) <= hand.settings.limits.max_force + 1e-9
