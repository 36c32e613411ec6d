"""The truth that a session is measured against: body and hands in equilibrium, without a network.

Each hand is a spring between its intention and its tip; the body is what the server owns, touched
through the same contacts. No law, no gain, no delay: forces f_i >= 0 such that every tip lies on
the surface it presses,

    n_i . (x_o,i(f) - intention_i - f_i n_i / k_i) = 0    wherever f_i > 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import Body, Response
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact, locate

_TOLERANCE = 1e-5  # N; and a hundred-thousandth of a millimetre of the tips
# m along the surface, which others may tilt by a third: a contact that stayed where a tick leaves
# it would leave its tip a fiftieth of a millimetre off the surface.
_EXACT = 1e-6
_NEARLY = 1e-2  # N; from here on contacts are found to that


@dataclass(frozen=True, slots=True)
class RestingHand:
    """A hand that holds still.

    Args:
        intention: Where it wants its tip [m].
        stiffness: Of the hand [N/m].
    """

    intention: Vec3
    stiffness: float


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What each hand feels in the end.

    Args:
        force: Normal force on each hand, shape (c,) [N].
        alone: Force that each hand would meet at the same place if nobody else touched, (c,) [N].
        tip: Of each hand, shape (c, 3) [m].
        compliance: C of the contacts, shape (c, c) [m/N].
    """

    force: Floats
    alone: Floats
    tip: Floats
    compliance: Floats

    @property
    def felt_from_others(self) -> Floats:
        """Part of each force that is there because others touch, shape (c,) [N]."""
        return np.asarray(self.force - self.alone)


def solve(body: Body, hands: Sequence[RestingHand]) -> Equilibrium:
    """Find the equilibrium of a body and hands.

    For contacts held fixed the problem is a linear complementarity problem with a positive definite
    matrix, solved exactly; the contacts then follow the tips, until both agree.

    Raises:
        BodyError: Contacts and forces do not settle.
    """
    n = len(hands)
    intention = np.array([hand.intention for hand in hands])
    hand_compliance = np.diag([1.0 / hand.stiffness for hand in hands])
    force = np.zeros(n)
    tip: Floats = intention.copy()
    free: list[Floats] = [np.zeros_like(body.mesh.vertices)] * n
    every = np.arange(len(body.mesh.vertices))
    contacts: list[Contact | None] = [None] * n
    response: Response | None = None
    exact: float | None = None
    for _ in range(200):
        now = [
            locate(
                body.mesh,
                tip[i],
                free[i],
                radius=body.contact_radius,
                hint=contacts[i],
                exact=exact,
            )
            for i in range(n)
        ]
        response = body.respond([c.load(f) for c, f in zip(now, force, strict=True)], response)
        # Depth of each intention below the resting surface, seen along the normal.
        bias = np.array([_lag(c, response, i, force) for i, c in enumerate(now)])
        depth = np.array([c.normal @ (c.point - intention[i]) for i, c in enumerate(now)]) - bias
        solved = complementarity(response.compliance + hand_compliance, depth)
        change = _largest(solved - force)
        force = solved
        response = body.respond([c.load(f) for c, f in zip(now, force, strict=True)], response)
        normals = np.array([c.normal for c in now])
        stretch = force / np.array([hand.stiffness for hand in hands])
        pushed: Floats = intention + normals * stretch[:, None]
        # Half steps: with many neighbours the contacts slide to and fro over a face otherwise.
        tip = 0.5 * (tip + pushed)
        free = [
            0.5 * (was + response.without(slice(i, i + 1), force[i : i + 1], every))
            for i, was in enumerate(free)
        ]
        contacts = list(now)
        if change < _NEARLY and exact is None:
            exact = _EXACT
        elif max(change, 1e3 * _largest(pushed - tip)) < _TOLERANCE:
            C = response.compliance
            at_rest = np.array([c.normal @ (c.point - t) for c, t in zip(now, tip, strict=True)])
            alone = np.maximum(0.0, at_rest) / np.diag(C)
            return Equilibrium(force, alone, tip, C)
    raise BodyError("body and hands found no equilibrium: the contacts keep sliding")


def _largest(change: Floats) -> float:
    return float(np.abs(change).max(initial=0.0))


def _lag(contact: Contact, response: Response, i: int, force: Floats) -> float:
    """What a body beyond the linear one displaces, over C f, along the normal of contact i [m]."""
    moved = contact.normal @ (contact.moved(response.displacement) - contact.point)
    return float(-moved - response.compliance[i] @ force)


def complementarity(M: Floats, q: Floats) -> Floats:
    """Solve f >= 0, M f - q >= 0, f . (M f - q) = 0 for symmetric positive definite M.

    Projected Gauss-Seidel to close by, then the active set exactly.

    Args:
        M: Shape (n, n).
        q: Shape (n,).
    """
    f = np.zeros(len(q))
    for _ in range(500):
        last = f.copy()
        for i in range(len(q)):
            f[i] = max(0.0, f[i] + (q[i] - M[i] @ f) / M[i, i])
        if np.abs(f - last).max() < 1e-12:
            break
    active = f > 0.0
    exact = np.zeros(len(q))
    if active.any():
        exact[active] = np.linalg.solve(M[np.ix_(active, active)], q[active])
    return exact if (exact >= 0.0).all() else f
