"""What any elastic body offers. The next body is one file that fulfils this Protocol."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cohaptic_server.bodies.mesh import Floats, Ints, SurfaceMesh


@dataclass(frozen=True, eq=False)
class Load:
    """A force on a patch of surface: a contact has a radius and a pressure profile (science 3.5).

    Args:
        vertices: Vertices under the contact, shape (k,).
        weights: Share of the force on each, shape (k,); they sum to 1.
        direction: Unit vector of the force, into the body, shape (3,).
        force: Magnitude [N].
    """

    vertices: Ints
    weights: Floats
    direction: Floats
    force: float


@dataclass(frozen=True, eq=False)
class Response:
    """The body under loads.

    Args:
        displacement: Of every vertex under all loads, shape (n, 3) [m].
        fields: Displacement of every vertex per unit of each load's force (the body's tangent
            Green's functions, seen through the contacts), shape (c, n, 3) [m/N].
        compliance: Contact compliance C: displacement of contact i along its direction per force
            at contact j, both weighted by the pressure profile, shape (c, c) [m/N].
        energy: Stored by the loads [J].
    """

    displacement: Floats
    fields: Floats
    compliance: Floats
    energy: float

    def free(self, i: int, force: float) -> Floats:
        """Displacement without the force of load i (science 3.3), shape (n, 3) [m]."""
        return np.asarray(self.displacement - force * self.fields[i])


class Body(Protocol):
    """An elastic body that accepts forces and returns positions (an admittance, section 1).

    Every implementation keeps the invariants of science 3.6: C symmetric and positive definite,
    no energy in a rigid motion, the hands' work never less than the energy stored.
    """

    @property
    def name(self) -> str:
        """Name for people and for the wire."""
        ...

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        ...

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        ...

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """The body in equilibrium with `loads`.

        Args:
            loads: The present contacts; a load of zero force still gets its compliance.
            before: Response of the tick before, from which an iterative body starts.
        """
        ...
