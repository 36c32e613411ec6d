"""Reference solution for hands that stick: body and hands in equilibrium, in three directions.

A finger with enough friction keeps the material point that it first touched. Its tip is then where
the forces of all users have displaced that point,

    intention_i + f_i / k_i = point_i + u_i(f),    u(f) = -C f on a linear body,

with f the force on each hand, k the stiffness of the hand, and C the compliance of all contacts in
3x3 blocks (science 3.10). This linear system is solved directly, without network, law or gain. For
a nonlinear body, Newton's method solves it with the body's tangent.
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
from cohaptic_server.world.displacement_field import Field, FreeField, ZeroField
from cohaptic_server.world.loads import Press, load_spans

_TOLERANCE = 1e-7  # N; upper bound of the change of any force in the last step
_MAX_ITERATIONS = 50  # of Newton's method
_MAX_TOUCH_DOWN_STEPS = 200
_GAP_TOLERANCE = 1e-7  # m between a tip and the surface on which it has landed
_MIN_FACING = 0.1  # cosine between the path and the inward normal; below it the path only grazes


@dataclass(frozen=True, eq=False)
class StickingHand:
    """A hand that holds still, with a finger that does not slip.

    Args:
        intention: Position that the hand wants for its tip [m].
        stiffness: Stiffness of the hand, in every direction [N/m].
        contact: Contact at the material point that the finger sticks to.
    """

    intention: Vec3
    stiffness: float
    contact: Contact


@dataclass(frozen=True, eq=False)
class StickingEquilibrium:
    """Forces of hands that stick, in equilibrium with the body.

    Args:
        force: Force on each hand, shape (n, 3) [N].
        normal: Outward normal of the surface free of each hand's own force, shape (n, 3).
        response: Response of the body; None without hands.
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


def solve_sticking(body: Body, hands: Sequence[StickingHand]) -> StickingEquilibrium:
    """Find the equilibrium of a body and of hands whose fingers all stick.

    Raises:
        BodyError: Newton's method does not converge.
    """
    n = len(hands)
    force = np.zeros((n, 3))
    if not hands:
        return StickingEquilibrium(force, force, None)
    response: Response | None = None
    for _ in range(_MAX_ITERATIONS):
        presses = [_press(h.contact, f) for h, f in zip(hands, force, strict=True)]
        response = body.respond([load for p in presses for load in p.loads()], response)
        residual = _tips(hands, force) - np.array(
            [_displaced(hand.contact, response) for hand in hands]
        )
        C = _in_space(response.compliance, presses)
        C += np.diag(np.repeat([1.0 / hand.stiffness for hand in hands], 3))
        change = -np.linalg.solve(C, residual.ravel()).reshape(n, 3)
        if np.abs(change).max() < _TOLERANCE:
            return StickingEquilibrium(force, _normals(body, hands, presses, response), response)
        force = force + change
    raise BodyError("body and hands that stick found no equilibrium")


def compliance_of(body: Body, hands: Sequence[StickingHand]) -> Floats:
    """Compliance C between contacts on a body at rest, in world axes, (n, 3, n, 3) [m/N]."""
    presses = [_press(hand.contact, np.zeros(3)) for hand in hands]
    response = body.respond([load for press in presses for load in press.loads()])
    return _in_space(response.compliance, presses).reshape(len(hands), 3, len(hands), 3)


def touch_down(body: Body, start: Floats, inward: Floats, others: StickingEquilibrium) -> Contact:
    """Find the material point that a hand meets on a straight path into the body.

    Args:
        body: The deformable object.
        start: Point of the path outside the body, shape (3,) [m].
        inward: Unit vector of the path, shape (3,).
        others: Equilibrium of the hands that already touch the body.

    Raises:
        BodyError: The path meets no surface.
    """
    field: Field = ZeroField()
    if others.response is not None:
        field = FreeField(others.response, np.zeros(0), slice(0, 0))
    tip = np.array(start, dtype=np.float64)
    contact: Contact | None = None
    for _ in range(_MAX_TOUCH_DOWN_STEPS):
        contact = locate(body.mesh, tip, field, radius=body.contact_radius)
        height = float(contact.normal @ (tip - contact.moved(field)))
        facing = -float(contact.normal @ inward)
        if abs(height) < _GAP_TOLERANCE:
            return contact
        if facing <= _MIN_FACING or not np.isfinite(height):
            break
        tip = tip + height / facing * inward
    raise BodyError("a hand found no surface on its way in")


def _press(contact: Contact, force: Floats) -> Press:
    pressed = float(force @ contact.normal)
    return Press(contact, pressed, force - pressed * contact.normal)


def _tips(hands: Sequence[StickingHand], force: Floats) -> Floats:
    """Position of each hand's tip under its force, shape (n, 3) [m]."""
    compliance = np.array([1.0 / hand.stiffness for hand in hands])
    return np.asarray(np.array([hand.intention for hand in hands]) + compliance[:, None] * force)


def _displaced(contact: Contact, response: Response) -> Floats:
    """Position of the material point of a contact, shape (3,) [m]."""
    return np.asarray(contact.point + contact.weights @ response.at(contact.vertices))


def _in_space(compliance: Floats, presses: Sequence[Press]) -> Floats:
    """Transform C from the axes of the contacts to world axes, shape (3 n, 3 n) [m/N]."""
    axes = np.zeros(compliance.shape)
    for i, press in enumerate(presses):
        axes[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = press.axes
    return np.asarray(axes.T @ compliance @ axes)


def _normals(
    body: Body, hands: Sequence[StickingHand], presses: Sequence[Press], response: Response
) -> Floats:
    """Normals of the surface free of each hand's own force, shape (n, 3)."""
    normals: list[Floats] = []
    loads = [press.loads() for press in presses]
    for hand, own, span in zip(hands, loads, load_spans(loads), strict=True):
        forces = np.array([load.force for load in own])
        free = FreeField(response, forces, span)
        normals.append(turned(body.mesh, hand.contact, free).normal)
    return np.array(normals)
