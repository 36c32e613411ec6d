"""Friction on material that other users displace (science 3.10)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.friction import (
    NO_FRICTION,
    Compliance3,
    FrictionState,
    follow_material,
    tangents,
)
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from tests.shared.control.contacts import (
    compliances,
    forces,
    fractions,
    mus,
    normals,
    paths,
    played,
    rub,
    ways,
)
from tests.strategies import vectors


@given(paths, ways, normals, forces, compliances(), mus, fractions)
def test_material_that_goes_is_a_hand_that_goes_the_other_way(
    path: list[Vec3], way: Vec3, n: Vec3, f_n: float, C: Compliance3, mu: float, fraction: float
) -> None:
    """Science 3.10: a hand that sticks while others drag the material feels that."""
    stuck = played(path, n, f_n, C, mu)
    dragged = rub(stuck, ZERO, n, f_n, C, mu, fraction, material=way)
    moved = rub(stuck, scale(way, -1.0), n, f_n, C, mu, fraction)
    assert dragged.force == pytest.approx(moved.force, rel=1e-9, abs=1e-12)
    assert dragged.stretch == pytest.approx(moved.stretch, rel=1e-9, abs=1e-15)
    # Only once: as long as it stays there nothing more happens.
    again = rub(dragged, ZERO, n, f_n, C, mu, fraction, material=way)
    assert again.force == pytest.approx(dragged.force, rel=1e-6, abs=1e-9)


def test_five_millimetres_of_material_give_the_force_of_science_3_10() -> None:
    """3.10: 4.9 mm sideways under a hand that sticks are about 0.63 N, not zero."""
    C = Compliance3(0.0078, 0.0078, 0.004, 0.0, 0.0, 0.0)
    n = (0.0, 0.0, 1.0)
    stuck = played([ZERO], n, 3.0, C, 0.5)
    assert stuck.force == ZERO
    dragged = rub(stuck, ZERO, n, 3.0, C, 0.5, material=(0.0049, 0.0, 0.0))
    assert dragged.force == pytest.approx((0.0049 / 0.0078, 0.0, 0.0))


@given(ways, normals, forces, compliances(), mus)
def test_where_the_material_was_when_the_contact_began_makes_no_force(
    material: Vec3, n: Vec3, f_n: float, C: Compliance3, mu: float
) -> None:
    first = rub(NO_FRICTION, ZERO, n, f_n, C, mu, material=scale(material, 10.0))
    assert first.force == rub(NO_FRICTION, ZERO, n, f_n, C, mu).force
    # Also after a lift-off in between, wherever it has gone meanwhile.
    lifted = rub(first, ZERO, n, 0.0, C, mu, material=material)
    assert lifted == NO_FRICTION
    anew = rub(lifted, ZERO, n, f_n, C, mu, material=material)
    assert anew.force == first.force


@given(normals, forces, mus, st.floats(1e-5, 1e-3), st.floats(-1e-3, 1e-3), fractions)
def test_a_hand_that_slides_does_not_feel_it(
    n: Vec3, f_n: float, mu: float, way: float, drag: float, fraction: float
) -> None:
    """As long as it goes faster than the material does."""
    C = Compliance3(0.004, 0.004, 0.004, 0.0, 0.0, 0.0)
    one, _ = tangents(n)
    slides = rub(NO_FRICTION, scale(one, 1.0), n, f_n, C, mu, fraction)
    there = rub(
        slides, scale(one, way), n, f_n, C, mu, fraction, material=scale(one, min(drag, way))
    )
    assert there.force == pytest.approx(slides.force, rel=1e-9, abs=1e-12)
    assert norm(there.force) == pytest.approx(mu * f_n)


@given(paths, vectors(0.02), normals, forces, compliances(), mus, fractions, st.floats(0.001, 0.1))
def test_others_move_the_force_by_so_much_in_a_period_and_all_the_way_in_the_end(
    path: list[Vec3],
    material: Vec3,
    n: Vec3,
    f_n: float,
    C: Compliance3,
    mu: float,
    fraction: float,
    max_change: float,
) -> None:
    stuck = rub(played(path, n, f_n, C, mu), ZERO, n, f_n, C, mu, fraction)
    # Until friction and contact agree on the share.
    stuck = rub(stuck, ZERO, n, f_n, C, mu, fraction)
    state = stuck
    for _ in range(30):
        before, gap = state.force, norm(sub(material, state.material))
        state = rub(state, ZERO, n, f_n, C, mu, fraction, material=material, max_change=max_change)
        assert norm(sub(state.force, before)) <= max_change * (1.0 + 1e-6) + 1e-9
        # It follows, in no more periods than it needs at the softest.
        left = norm(sub(material, state.material))
        softest = max_change * min(C.xx, C.yy, C.zz) / (30.0 * fraction)
        assert left <= max(0.0, gap - softest) + 1e-12


@given(vectors(0.02), vectors(0.02), st.floats(0.0, 0.01), st.booleans())
def test_an_anchor_goes_straight_to_where_the_material_is(
    was: Vec3, now: Vec3, max_change: float, touching: bool
) -> None:
    way, followed = follow_material(FrictionState(ZERO, ZERO, was, touching), now, max_change)
    if not touching:
        assert (way, followed) == (ZERO, now)
        return
    gap = sub(now, was)
    assert norm(way) == pytest.approx(min(max_change, norm(gap)), abs=1e-15)
    assert sub(followed, was) == pytest.approx(way, abs=1e-15)
    assert norm(sub(now, followed)) == pytest.approx(norm(gap) - norm(way), abs=1e-15)
