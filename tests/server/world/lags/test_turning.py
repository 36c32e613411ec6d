from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact, Contacts, locate
from cohaptic_server.world.displacement_field import ZeroField
from cohaptic_server.world.lags.turning import (
    LONGEST_TURN,
    Turned,
    find_turning_lag,
    steep_contacts,
    turned_loop,
)
from tests.server.touches import contacts_of, touch, user_of
from tests.server.world.lags.lag_rooms import DT

DEEP = 0.7  # slope of a probe at 0.3 of the radius of curvature
STIFF = 200.0  # N/m, along the normal


def contacts_at(body: Balloon, slopes: list[float]) -> Contacts:
    found: list[Contact] = []
    for k, slope in enumerate(slopes):
        probe = 0.09 * np.array([np.cos(k), np.sin(k), 0.2])
        contact = locate(body.mesh, probe, ZeroField(), radius=body.contact_radius)
        found.append(Contact(contact.frame, contact.vertices, contact.weights, slope))
    return contacts_of(found)


def limb_compliance(sideways: float) -> Floats:
    """C of two steep contacts: the press of each moves the other along its surface [m/N]."""
    C = np.diag([1.0, sideways, sideways, 1.0, sideways, sideways])
    C[0, 4] = C[4, 0] = C[3, 1] = C[1, 3] = 0.9 * np.sqrt(sideways)
    return np.asarray(C / STIFF)


def loop_of(
    body: Balloon, slopes: list[float], sideways: float, *, press: bool = True
) -> Turned | None:
    users = [user_of(touch(i, max_stiffness=1e4)) for i in (1, 2)]
    steep = steep_contacts(np.array(slopes))
    widths = [3 if i in steep else 1 for i in (0, 1)]
    rows = [3 * i + k for i in (0, 1) for k in range(widths[i])]
    ends = np.cumsum([0, *widths]).tolist()
    spans = [slice(ends[0], ends[1]), slice(ends[1], ends[2])]
    C = limb_compliance(sideways)[np.ix_(rows, rows)]
    return turned_loop(users, C, spans, contacts_at(body, slopes), body.mesh, np.full(2, press))


def lag_of(
    body: Balloon, slopes: list[float], sideways: float, delay: float = 0.1, *, press: bool = True
) -> float:
    return find_turning_lag(loop_of(body, slopes, sideways, press=press), delay + DT, 0.0)


def test_a_limb_that_gives_way_sideways_needs_a_lag_and_another_none(
    small_balloon: Balloon,
) -> None:
    """At the same slope: what counts is how far the others move the contact along the surface."""
    assert lag_of(small_balloon, [DEEP, DEEP], 1.0) == 0.0
    assert 0.0 < lag_of(small_balloon, [DEEP, DEEP], 8.0) < LONGEST_TURN
    assert lag_of(small_balloon, [DEEP, DEEP], 1e4) == LONGEST_TURN


def test_it_grows_with_delay_and_a_hand_in_the_air_turns_nobody(small_balloon: Balloon) -> None:
    lags = [lag_of(small_balloon, [DEEP, DEEP], 8.0, delay) for delay in (0.02, 0.1, 0.3)]
    assert lags[0] < lags[1] < lags[2]
    assert lag_of(small_balloon, [DEEP, DEEP], 8.0, press=False) == 0.0


@pytest.mark.parametrize("slope", [0.0, 1e-9, 0.1])
def test_the_deepest_probe_has_a_lag_that_is_finite(small_balloon: Balloon, slope: float) -> None:
    assert lag_of(small_balloon, [slope, 1.0], 8.0) <= LONGEST_TURN


def test_contacts_that_are_turned_make_the_object_no_stiffer_and_answer_as_in_time(
    small_balloon: Balloon,
) -> None:
    """t = S_tp p + S_tt t, iterated to its end, gives what `answer` says at once."""
    turned = loop_of(small_balloon, [DEEP, 0.5], 1.0)
    assert turned is not None
    assert 0.0 <= turned.along < 1.0
    answer, S = turned.answer(), turned.S
    assert np.linalg.eigvalsh(answer)[0] >= -1e-12
    for p in np.eye(2):
        t = np.zeros(turned.tangents)
        for _ in range(400):
            t = S[2:, :2] @ p + S[2:, 2:] @ t
        assert S[:2, 2:] @ t == pytest.approx(answer @ p, abs=1e-9)
