"""Chooses how soft an object is, so that a hand can press it with a force that is felt.

On a linear elastic body each compliance is in proportion to 1 / E, with Young's modulus E. So the
compliances of one build, at any E, are known at every E. `fitting_young` takes the stiffness at a
usual place of the surface to a value at which a finger presses with a few newtons and leaves a dent
of a few millimetres. Where an object is soft because it sways on thin legs, its material is as hard
as it has to be to carry such a press.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.mesh.surface import spread_over


class Material(NamedTuple):
    """A familiar material.

    Args:
        name: Its name.
        young: Young's modulus [Pa]; `web/src/upload/softness.ts` has the sources.
    """

    name: str
    young: float


# The page has the same table, and the same words (web/src/upload/softness.ts).
MATERIALS = (
    Material("jelly", 3e3),
    Material("liver", 6e3),
    Material("silicone", 7e4),
    Material("rubber", 1e6),
)
_LIKE = 1.25  # ratio of two moduli up to which one material is like the other


def softness_words(young: float) -> str:
    """Return words such as "like liver, 6 kPa", with the material of the nearest modulus.

    Args:
        young: Young's modulus [Pa].
    """
    likest = min(MATERIALS, key=lambda material: abs(math.log(material.young / young)))
    ratio = young / likest.young
    how = "harder than" if ratio > _LIKE else "softer than" if ratio < 1.0 / _LIKE else "like"
    size, unit = (1e6, "MPa") if young >= 1e6 else (1e3, "kPa")
    return f"{how} {likest.name}, {_two_digits(young / size):g} {unit}"


def _two_digits(value: float) -> float:
    return float(f"{value:.2g}")


# A usual place has the stiffness PRESS / DENT, 600 N/m: less than a device renders, and as stiff as
# a hand, so that a hand 5 to 20 mm deep presses with 1 to 5 N. Two hands on a compact object feel a
# tenth of each other's force, or 0.2 N of 2 N. On a small object the dent is a share of its size.
PRESS = 3.0  # N
DENT = 0.005  # m
_DENT_FRACTION = 0.15  # of `SurfaceMesh.size`
_STIFFEST = 1500.0  # N/m; a simulated device renders 2000 N/m
_PLACES = 400  # vertices, spread over the surface
SOFTEST, HARDEST = 1e3, 1e10  # Pa; a third of jelly's, and more than that of hard plastic


def fitting_young(body: Body, young: float) -> float:
    """Return Young's modulus at which a press on a usual place is felt, with two digits [Pa].

    Args:
        body: The body at rest, of one material.
        young: Its Young's modulus [Pa].

    Raises:
        BodyError: No place of the surface can be pressed.
    """
    table = vertex_compliance(body, spread_over(body.mesh.vertices, _PLACES))
    free = table[table > 0.0]
    if not len(free):
        raise BodyError(f"{body.name}: no place of its surface can be pressed; hold less of it")
    wanted = min(PRESS / min(DENT, _DENT_FRACTION * body.mesh.size), _STIFFEST)
    fitting = young * wanted * float(np.median(free))
    return _two_digits(min(HARDEST, max(SOFTEST, fitting)))
