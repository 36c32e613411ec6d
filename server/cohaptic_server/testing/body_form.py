"""What a body has to be before the laws can be tried on it: its attributes, surface and arrays.

Each check asserts one property and explains in one sentence what breaks it, since a body of this
kind would else fail with an error from inside of some law, or pass all of them and be unusable.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from cohaptic.protocol.messages import MAX_BODY_NAME
from cohaptic_server.bodies.body import Body, DenseResponse
from cohaptic_server.bodies.vertex_presses import presses_at
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.surface import SurfaceMesh, spread_over
from cohaptic_server.numeric import Ints

# As for objects of files (`objects/surface/accept.py`, which stands above this package).
MIN_SIZE, MAX_SIZE = 0.005, 5.0  # m; longest side of the mesh's bounding box
_LIKELY = (0.02, 1.0)  # m; longest side of most objects that are touched with a hand
_UNITS = (("millimetres", 1e-3), ("centimetres", 1e-2))
MAX_RADIUS = 0.5  # m; largest contact radius of the bodies of this package
_FLAT = 1e-9  # volume over the cube of the size below which a surface encloses practically none
T = TypeVar("T")

_PARTS = ("compliance", "displacement", "energy", "displacement_of", "without")


class BrokenLawError(AssertionError):
    """A body breaks a law.

    Args:
        law: Name of the law, or of the check of a body's form.
        reason: Observation that contradicts the law.
    """

    def __init__(self, law: str, reason: object) -> None:
        super().__init__(f"{law}: {reason}")
        self.law = law


def keep(law: Callable[[T], None], subject: T) -> None:
    """Try a law or a check of the form on what it is about.

    Raises:
        BrokenLawError: It does not hold.
    """
    try:
        law(subject)
    except AssertionError as error:
        raise BrokenLawError(law.__name__, error) from error


def has_a_name(body: Body) -> None:
    """Assert that the name is a text which fits the messages to clients."""
    name: object = getattr(body, "name", None)
    assert isinstance(name, str), f"`name` is {name!r}; it has to be a text"
    assert 0 < len(name) <= MAX_BODY_NAME, (
        f"`name` has {len(name)} characters; it has to have from 1 to {MAX_BODY_NAME}"
    )


def says_whether_it_is_linear(body: Body) -> None:
    """Assert that the body has the attribute `linear`."""
    assert isinstance(getattr(body, "linear", None), bool), "it has no attribute `linear: bool`"


def is_of_a_size_for_hands(body: Body) -> None:
    """Assert that the body has a mesh as large as an object that is touched, in metres."""
    mesh: object = getattr(body, "mesh", None)
    assert isinstance(mesh, SurfaceMesh), (
        f"`mesh` is {_named(mesh)}; it has to be a SurfaceMesh(vertices, faces)"
    )
    size = float(np.ptp(mesh.vertices, axis=0).max())
    assert MIN_SIZE <= size <= MAX_SIZE, (
        f"the mesh is {size:.4g} m long; it has to be from {MIN_SIZE:g} to {MAX_SIZE:g} m long"
        f"{_other_units(size)}"
    )


def has_a_contact_radius(body: Body) -> None:
    """Assert that the contact radius is that of a finger or a tool."""
    radius: object = getattr(body, "contact_radius", None)
    assert isinstance(radius, float | int), f"`contact_radius` is {radius!r}; it has to be a number"
    assert 0.0 < radius <= MAX_RADIUS, (
        f"`contact_radius` is {radius:g} m; it has to be above 0 and at most {MAX_RADIUS:g} m"
    )


def faces_look_outwards(body: Body) -> None:
    """Assert that neighbouring faces look to one side, and those of a closed surface outwards.

    Whether an open surface as a whole looks outwards cannot be known.
    """
    x, faces = body.mesh.vertices, body.mesh.faces
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, which, counts = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    order = np.argsort(which.ravel(), kind="stable")
    first = (np.cumsum(counts) - counts)[counts == 2]
    one, other = order[first], order[first + 1]  # the two places of each edge with two faces
    wrong = np.flatnonzero(edges[one, 0] == edges[other, 0])
    if len(wrong):
        raise AssertionError(_turned(edges, one[wrong], other[wrong]))
    if (counts == 2).all():
        inside = volume(x - x.mean(axis=0), faces)
        least = -_FLAT * float(np.ptp(x, axis=0).max()) ** 3
        assert inside >= least, (
            f"the surface encloses {inside:.3g} m^3, and this has to be above 0: its normals point"
            " inwards. Turn the faces with faces[:, ::-1]"
        )


def answers_with_a_response(body: Body) -> None:
    """Assert that the response to two loads has all its parts, in the right shapes."""
    mesh = body.mesh
    loads = list(presses_at(mesh, spread_over(mesh.vertices, 2), body.contact_radius))
    response: object = body.respond(loads)
    lacking = [part for part in _PARTS if not hasattr(response, part)]
    assert not lacking, (
        f"`respond` returned {_named(response)}, which lacks {', '.join(lacking)}; it has to return"
        " a Response, such as a DenseResponse"
    )
    c, n = len(loads), len(mesh.vertices)
    shapes: dict[str, tuple[int, ...]] = {"energy": (), "compliance": (c, c)}
    shapes["displacement"] = (n, 3)
    if isinstance(response, DenseResponse):
        shapes["fields"] = (c, n, 3)
    for part, shape in shapes.items():
        value = np.asarray(getattr(response, part))
        assert value.dtype.kind in "fiu", f"`{part}` of a response is no number: {value.dtype}"
        assert value.shape == shape, (
            f"`{part}` of a response to {c} loads has the shape {value.shape}; on a mesh of {n}"
            f" vertices it has to have {shape}"
        )


Form = Callable[[Body], None]
FORMS: tuple[Form, ...] = (
    has_a_name,
    says_whether_it_is_linear,
    is_of_a_size_for_hands,
    has_a_contact_radius,
    faces_look_outwards,
    answers_with_a_response,
)


def _named(value: object) -> str:
    """Return words for a value of a wrong type."""
    return "None" if value is None else f"of type {type(value).__name__}"


def _other_units(size: float) -> str:
    """Return the question whether a mesh is in other units; empty if none makes it a usual object.

    Args:
        size: Longest side of the mesh, in units of its vertices.
    """
    low, high = _LIKELY
    likely = [(unit, scale) for unit, scale in _UNITS if low <= scale * size <= high]
    if not likely:
        return ""
    units, scales = " or ".join(u for u, _ in likely), " or ".join(f"{s:g}" for _, s in likely)
    return f". Is it in {units}? Multiply its vertices by {scales}"


def _turned(edges: Ints, one: Ints, other: Ints) -> str:
    """Return a sentence about edges along which the faces on both sides run in one direction.

    Args:
        edges: First and second vertex of each edge of each face in turn, shape (3 m, 2).
        one, other: The two places of each such edge in `edges`, shape (k,) each.
    """
    a, b = edges[one[0]].tolist()
    return (
        f"{len(one)} edges have faces that look to opposite sides, and it has to be 0: faces"
        f" {one[0] // 3} and {other[0] // 3} both run from vertex {a} to vertex {b}. All faces have"
        " to run counter-clockwise seen from outside"
    )
