"""Each check of a body's form is seen to fail, with a sentence of the value and the limit."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.body import Body, DenseResponse, Load, Response
from cohaptic_server.bodies.spring import plate
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Ints
from cohaptic_server.objects.surface import accept
from cohaptic_server.testing import BrokenLawError, check_body
from cohaptic_server.testing.body_form import FORMS, MAX_SIZE, MIN_SIZE
from tests.server.testing.broken_bodies import BALLOON, Changed, unchanged

WHOLE = BALLOON.mesh
PLATE = SurfaceMesh(*plate(0.1, 4))


class Answering(Changed):
    """The balloon with an answer that may be no response at all."""

    def __init__(self, answer: Callable[[DenseResponse], Any]) -> None:
        super().__init__(unchanged)
        self.answer = answer

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Any:
        return self.answer(super().respond(loads, before))


def with_(**attributes: object) -> Body:
    """The balloon with other attributes."""
    body = Changed(unchanged)
    for name, value in attributes.items():
        setattr(body, name, value)
    return body


def turned(mesh: SurfaceMesh, which: slice | Ints) -> SurfaceMesh:
    """The mesh with some faces turned over."""
    faces = np.array(mesh.faces)
    faces[which] = faces[which][:, ::-1]
    return SurfaceMesh(np.array(mesh.vertices), faces)


def scaled(scale: float) -> SurfaceMesh:
    return SurfaceMesh(scale * WHOLE.vertices, np.array(WHOLE.faces))


LONG = float(np.ptp(WHOLE.vertices, axis=0).max())  # m
NOTHING: Any = None
N = len(WHOLE.vertices)
# Of each: the body, the check that fails, and words of its sentence.
BROKEN: dict[str, tuple[Callable[[], Body], str, str]] = {
    "no name": (lambda: with_(name=None), "has_a_name", "`name` is None; it has to be a text"),
    "an empty name": (lambda: with_(name=""), "has_a_name", "0 characters; .* from 1 to 1024"),
    "no word about linearity": (
        lambda: with_(linear=None),
        "says_whether_it_is_linear",
        "no attribute `linear: bool`",
    ),
    "an array as mesh": (
        lambda: with_(mesh=np.zeros((4, 3))),
        "is_of_a_size_for_hands",
        "`mesh` is of type ndarray; it has to be a SurfaceMesh",
    ),
    "millimetres taken for metres": (
        lambda: with_(mesh=scaled(100.0 / LONG)),
        "is_of_a_size_for_hands",
        r"is 100 m long; it has to be from 0.005 to 5 m long. Is it in millimetres or centimetres\?"
        " Multiply its vertices by 0.001 or 0.01",
    ),
    "a mote": (
        lambda: with_(mesh=scaled(0.001 / LONG)),
        "is_of_a_size_for_hands",
        "is 0.001 m long; it has to be from 0.005 to 5 m long$",
    ),
    "no contact radius": (
        lambda: with_(contact_radius=None),
        "has_a_contact_radius",
        "`contact_radius` is None; it has to be a number",
    ),
    "a contact radius in millimetres": (
        lambda: with_(contact_radius=20.0),
        "has_a_contact_radius",
        "is 20 m; it has to be above 0 and at most 0.5 m",
    ),
    "a ball inside out": (
        lambda: with_(mesh=turned(WHOLE, slice(None))),
        "faces_look_outwards",
        r"encloses -0\.\d+ m\^3, and this has to be above 0: its normals point inwards",
    ),
    "a ball with one face turned": (
        lambda: with_(mesh=turned(WHOLE, np.array([7]))),
        "faces_look_outwards",
        r"3 edges .* has to be 0: faces \d+ and \d+ both run from vertex \d+ to vertex \d+",
    ),
    "a plate with one face turned": (
        lambda: with_(mesh=turned(PLATE, np.array([3]))),
        "faces_look_outwards",
        "edges have faces that look to opposite sides",
    ),
    "no response": (
        lambda: Answering(lambda r: None),
        "answers_with_a_response",
        "returned None, which lacks compliance, displacement, energy.* DenseResponse",
    ),
    "one field for all loads": (
        lambda: Answering(lambda r: replace(r, fields=r.fields.sum(axis=0))),
        "answers_with_a_response",
        rf"`fields` of a response to 2 loads has the shape \({N}, 3\); .* \(2, {N}, 3\)",
    ),
    "a displacement in one row": (
        lambda: Answering(lambda r: replace(r, displacement=r.displacement.ravel())),
        "answers_with_a_response",
        rf"`displacement` .* the shape \({3 * N},\); .* \({N}, 3\)",
    ),
    "no energy": (
        lambda: Answering(lambda r: replace(r, energy=NOTHING)),
        "answers_with_a_response",
        "`energy` of a response is no number",
    ),
}


@pytest.mark.parametrize("what", BROKEN)
def test_what_is_no_body_is_told_in_one_sentence(what: str) -> None:
    make, check, words = BROKEN[what]
    with pytest.raises(BrokenLawError) as error:
        check_body(make())
    assert error.value.law == check
    assert re.search(words, str(error.value)), str(error.value)
    assert "\n" not in str(error.value)


def test_no_check_is_without_a_body_that_fails_it() -> None:
    assert {form.__name__ for form in FORMS} == {check for _, check, _ in BROKEN.values()}


@pytest.mark.parametrize(
    "mesh", [WHOLE, PLATE, turned(PLATE, slice(None)), scaled(MAX_SIZE / LONG)]
)
def test_surfaces_that_are_right_pass(mesh: SurfaceMesh) -> None:
    """Of an open surface either side may be the outer one."""
    body = with_(mesh=mesh)
    for form in FORMS[:-1]:  # the balloon's response is of its own mesh
        form(body)


def test_a_body_may_be_as_large_as_an_object_of_a_file() -> None:
    assert (accept.MIN_SIZE, accept.MAX_SIZE) == (MIN_SIZE, MAX_SIZE)
