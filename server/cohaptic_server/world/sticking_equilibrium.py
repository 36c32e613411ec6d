"""The truth of hands that stick: body and hands in equilibrium, in all three directions at once.

A finger with enough friction keeps the material that it first touched. Its tip is then where that
material is, wherever the forces of everybody have taken it,

    intention_i + f_i / k_i = point_i + u_i(f),    u(f) = -C f on a linear body,

with f the force on each hand and C the compliance of all contacts in 3x3 blocks (science 3.10): a
linear system, solved directly, without network, law or gain. A body beyond the linear one is solved
by Newton's method on its tangent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import Body, Response
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact, locate, turned
from cohaptic_server.world.displacement_field import Field, FreeOf, Still
from cohaptic_server.world.loads import Press, spans

_TOLERANCE = 1e-7  # N
_NEWTON = 50
_CLOSE = 1e-7  # m between the tip and the surface that it has come down to


@dataclass(frozen=True, eq=False)
class StickingHand:
    """A hand that holds still, with a finger that does not slip.

    Args:
        intention: Where it wants its tip [m].
        stiffness: Of the hand, in every direction [N/m].
        contact: The material that it sticks to.
    """

    intention: Vec3
    stiffness: float
    contact: Contact


@dataclass(frozen=True, eq=False)
class Stuck:
    """What each hand feels in the end.

    Args:
        force: On each hand, shape (n, 3) [N].
        normal: Outward, of the surface free of each hand's own force, shape (n, 3).
        response: Of the body.
    """

    force: Floats
    normal: Floats
    response: Response | None

    @property
    def pressed(self) -> Floats:
        """Normal part of each force, shape (n,) [N]."""
        return np.asarray(np.einsum("ni,ni->n", self.force, self.normal))

    @property
    def friction_needed(self) -> Floats:
        """Coefficient of friction below which each finger would slip, shape (n,)."""
        along = self.force - self.pressed[:, None] * self.normal
        pressed = np.maximum(self.pressed, 1e-12)
        return np.asarray(np.linalg.norm(along, axis=1) / pressed)


def solve_sticking(body: Body, hands: Sequence[StickingHand]) -> Stuck:
    """Find the equilibrium of a body and hands that stick, every one of them.

    Raises:
        BodyError: Newton's method found none.
    """
    n = len(hands)
    force = np.zeros((n, 3))
    if not hands:
        return Stuck(force, force, None)
    response: Response | None = None
    for _ in range(_NEWTON):
        presses = [_press(h.contact, f) for h, f in zip(hands, force, strict=True)]
        response = body.respond([load for p in presses for load in p.loads()], response)
        tip_off = _tips(hands, force) - np.array([_moved(hand.contact, response) for hand in hands])
        C = _in_space(response.compliance, presses)
        C += np.diag(np.repeat([1.0 / hand.stiffness for hand in hands], 3))
        change = -np.linalg.solve(C, tip_off.ravel()).reshape(n, 3)
        if np.abs(change).max() < _TOLERANCE:
            return Stuck(force, _normals(body, hands, presses, response), response)
        force = force + change
    raise BodyError("body and hands that stick found no equilibrium")


def compliance_of(body: Body, hands: Sequence[StickingHand]) -> Floats:
    """C of the contacts of hands on a body at rest, in space, shape (n, 3, n, 3) [m/N]."""
    presses = [_press(hand.contact, np.zeros(3)) for hand in hands]
    response = body.respond([load for press in presses for load in press.loads()])
    return _in_space(response.compliance, presses).reshape(len(hands), 3, len(hands), 3)


def touch_down(body: Body, start: Floats, inward: Floats, others: Stuck) -> Contact:
    """The material that a hand meets on its straight way in.

    Args:
        body: That is touched.
        start: Somewhere on the way, outside the body, shape (3,) [m].
        inward: Unit vector of the way, shape (3,).
        others: Who hold the body meanwhile.

    Raises:
        BodyError: There is no surface on the way.
    """
    field: Field = Still()
    if others.response is not None:
        field = FreeOf(others.response, np.zeros(0), slice(0, 0))
    tip = np.array(start, dtype=np.float64)
    contact: Contact | None = None
    for _ in range(200):
        contact = locate(body.mesh, tip, field, radius=body.contact_radius)
        height = float(contact.normal @ (tip - contact.moved(field)))
        facing = -float(contact.normal @ inward)
        if abs(height) < _CLOSE:
            return contact
        if facing <= 0.1 or not np.isfinite(height):
            break
        tip = tip + height / facing * inward
    raise BodyError("a hand found no surface on its way in")


def _press(contact: Contact, force: Floats) -> Press:
    pressed = float(force @ contact.normal)
    return Press(contact, pressed, force - pressed * contact.normal)


def _tips(hands: Sequence[StickingHand], force: Floats) -> Floats:
    """Where each hand's tip is under its force, shape (n, 3) [m]."""
    soft = np.array([1.0 / hand.stiffness for hand in hands])
    return np.asarray(np.array([hand.intention for hand in hands]) + soft[:, None] * force)


def _moved(contact: Contact, response: Response) -> Floats:
    """Where the material of a contact is, shape (3,) [m]."""
    return np.asarray(contact.point + contact.weights @ response.at(contact.vertices))


def _in_space(compliance: Floats, presses: Sequence[Press]) -> Floats:
    """C between the forces of contacts in space instead of along their axes, (3 n, 3 n) [m/N]."""
    axes = np.zeros(compliance.shape)
    for i, press in enumerate(presses):
        axes[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = press.axes
    return np.asarray(axes.T @ compliance @ axes)


def _normals(
    body: Body, hands: Sequence[StickingHand], presses: Sequence[Press], response: Response
) -> Floats:
    """Of the surface free of each hand's own force, shape (n, 3)."""
    found: list[Floats] = []
    for hand, press, span in zip(hands, presses, spans(presses), strict=True):
        own = np.array([load.force for load in press.loads()])
        found.append(turned(body.mesh, hand.contact, FreeOf(response, own, span)).normal)
    return np.array(found)
