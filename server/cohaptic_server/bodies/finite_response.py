"""The surface of a body under finite deformation without one user's own forces (science 3.12).

On a linear body the surface without a user's force does not depend on that force. Under finite
deformation it does: u - C f, with u and C of the deformed state, bends as the force f grows. A
pressing finger then turns its own contact, receives the turn a loop delay later, and swings.

Therefore a user's free surface also leaves out the displacement beyond the tangent,
r = u - sum C f, in proportion to that user's share of the dent at each place. A user who is alone
gets the resting surface. The surface is then shifted as a whole along the force, so that in this
direction the contact point stays at u - C f: this is the step of Newton's method, which any other
position would spoil.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cohaptic_server.bodies.body import DenseResponse, Load
from cohaptic_server.numeric import Floats, Ints

# m; in a dent far smaller than this all shares are near 0, so that none jumps when a force begins.
_NO_DENT = 1e-6


@dataclass(frozen=True, eq=False)
class FiniteResponse(DenseResponse):
    """A response whose displacement is not the sum of its fields times forces.

    Args:
        loads: Loads that caused the response.
    """

    loads: Sequence[Load]

    def without_own(self, spans: Ints, forces: Floats, starts: Ints, vertices: Ints) -> Floats:
        """Displacement of some vertices for each user, without that user's loads and part of r."""
        left = super().without_own(spans, forces, starts, vertices)
        users = zip(pairwise(spans.tolist()), pairwise(starts.tolist()), strict=True)
        for (first, last), (a, b) in users:
            if first < last and a < b:
                left[a:b] -= self._own_beyond_tangent(first, last, vertices[a:b])
        return left

    def _own_beyond_tangent(self, first: int, last: int, vertices: Ints) -> Floats:
        """A user's part of r, less the contact's motion along the force in this part, (k, 3) [m].

        Args:
            first, last: Index of the user's first load, which acts along the normal, and the index
                after the user's last load.
            vertices: Vertices whose displacement is wanted, shape (k,).
        """
        load = self.loads[first]
        every = np.concatenate([vertices, load.vertices])
        forces = np.array([one.force for one in self.loads])
        dents = forces[:, None, None] * self.fields[:, every]
        own, tangent = dents[first:last].sum(axis=0), dents.sum(axis=0)
        mine, others = (own**2).sum(axis=1), ((tangent - own) ** 2).sum(axis=1)
        share = mine / (mine + others + _NO_DENT**2)
        part = share[:, None] * (self.displacement[every] - tangent)
        contact = load.weights @ part[len(vertices) :]
        return np.asarray(part[: len(vertices)] - (contact @ load.direction) * load.direction)
