from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.friction import times
from cohaptic.protocol.patch import MAX_COMPLIANCE, MIN_COMPLIANCE
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import vec3
from cohaptic_server.world.contact import locate
from cohaptic_server.world.loads import (
    MIN_EIGENVALUE_FRACTION,
    Press,
    bounded,
    compliance_between,
    contact_compliance,
    load_spans,
)
from tests.examples_of_laws import examples

angles = st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=4)
forces = st.floats(0.0, 5.0)


def press(body: Balloon, angle: float, force: float, along: float | None) -> Press:
    probe = 0.1 * np.array([np.cos(angle), np.sin(angle), 0.2])
    still = np.zeros_like(body.mesh.vertices)
    contact = locate(body.mesh, probe, still, radius=body.contact_radius)
    if along is None:
        return Press(contact, force)
    tangent = np.cross(contact.normal, [0.0, 0.0, 1.0])
    return Press(contact, force, along * tangent / np.linalg.norm(tangent))


@given(angles, forces, st.floats(-3.0, 3.0))
@settings(max_examples=examples(20), deadline=None)
def test_the_3x3_compliance_moves_the_contact_as_the_body_does(
    small_balloon: Balloon, where: list[float], force: float, along: float
) -> None:
    """The contact point moves by -C f for a force f on the hand."""
    mine = press(small_balloon, where[0], force, along)
    response = small_balloon.respond(mine.loads())
    C = contact_compliance(response.compliance, mine.contact.normal, load_spans([mine.loads()])[0])
    assert C is not None
    assert mine.tangential is not None
    f = mine.force * mine.contact.normal + mine.tangential
    moved = mine.contact.weights @ response.displacement[mine.contact.vertices]
    assert moved == pytest.approx(-np.array(times(C, vec3(f))), abs=1e-12)


@given(angles)
@settings(max_examples=examples(20), deadline=None)
def test_without_friction_c_between_users_is_the_bodys(
    small_balloon: Balloon, where: list[float]
) -> None:
    presses = [press(small_balloon, a, 1.0, None) for a in where]
    response = small_balloon.respond([load for p in presses for load in p.loads()])
    C = compliance_between(response.compliance, load_spans([p.loads() for p in presses]))
    assert C == pytest.approx(np.abs(response.compliance))


@given(angles)
@settings(max_examples=examples(20), deadline=None)
def test_with_friction_a_row_bounds_every_direction(
    small_balloon: Balloon, where: list[float]
) -> None:
    """kappa C_dd sum |C_d,other| <= alpha for each direction d, if it holds for the row."""
    presses = [press(small_balloon, a, 1.0, 0.2) for a in where]
    response = small_balloon.respond([load for p in presses for load in p.loads()])
    parts = load_spans([p.loads() for p in presses])
    C, full = compliance_between(response.compliance, parts), np.abs(response.compliance)
    for i, mine in enumerate(parts):
        others = C[i].sum() - C[i, i]
        for d in range(mine.start, mine.stop):
            away = full[d].sum() - full[d, mine].sum()
            assert away / full[d, d] <= others / C[i, i] + 1e-9


@given(
    st.lists(st.sampled_from([1, 3]), min_size=1, max_size=4),
    st.integers(0, 2**32 - 1),
    st.lists(st.booleans(), min_size=4, max_size=4),
    st.integers(0, 3),
)
def test_what_is_held_gets_the_least_compliance_and_nothing_else_changes(
    axes: list[int], seed: int, held: list[bool], more: int
) -> None:
    """A contact like any other then: definite, symmetric, and as stiff as the device."""
    ends = np.cumsum([0, *axes]).tolist()
    where = [slice(a, b) for a, b in itertools.pairwise(ends)]
    n = ends[-1] + more  # what fades beside the users is none of them
    A = np.random.default_rng(seed).normal(size=(n, n + 2))
    C = 5e-4 * (A @ A.T + (A @ A.T).T)
    for span, is_held in zip(where, held, strict=False):
        if is_held:
            C[span] = C[:, span] = 0.0
    kept = C.copy()
    found = bounded(C, where)
    assert (kept == C).all()
    assert found.shape == (ends[-1],) * 2
    assert (found == found.T).all()
    assert np.linalg.eigvalsh(found).min() > 0.0
    for span, is_held in zip(where, held, strict=False):
        own = found[span, span]
        if is_held:
            assert own == pytest.approx(MIN_COMPLIANCE * np.eye(len(own)))
        else:
            assert (own == C[span, span]).all()
    for i, mine in enumerate(where):
        for other in where[i + 1 :]:
            assert (found[mine, other] == C[mine, other]).all()


@given(st.integers(0, 2**32 - 1), st.floats(-8.0, 5.0), st.integers(1, 3))
def test_what_is_soft_in_some_directions_only_stays_within_both_bounds(
    seed: int, exponent: float, rank: int
) -> None:
    """In any axes, since the wire carries those of the world."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(6, rank)) * 10.0**exponent
    found = bounded(A @ A.T, [slice(0, 3), slice(3, 6)])
    for own in (found[:3, :3], found[3:, 3:]):
        least, _, limit = np.linalg.eigvalsh(own).tolist()
        assert limit <= MAX_COMPLIANCE
        assert least >= 0.999 * max(MIN_COMPLIANCE, MIN_EIGENVALUE_FRACTION * limit)
