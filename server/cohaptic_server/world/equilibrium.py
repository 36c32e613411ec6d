"""Reference solutions for a session: body and hands in equilibrium, frictionless or sticking.

Each hand is a spring between its intention, the position that it wants for its tip, and the tip.
The body is the one that the server simulates, with the same model of contact. There is no network,
control law, gain or delay.

Without friction there are only forces f_i >= 0 such that every tip lies on the surface that it
presses,

    n_i . (x_o,i(f) - intention_i - f_i n_i / k_i) = 0    wherever f_i > 0,

with the normal n_i, the surface point x_o,i and the stiffness k_i of each hand.

A finger with enough friction keeps the material point that it first touched. Its tip is then where
the forces of all users have displaced that point, in three directions,

    intention_i + f_i / k_i = point_i + u_i(f),    u(f) = -C f on a linear body,

with f the force on each hand, k the stiffness of the hand, and C the compliance of all contacts in
3x3 blocks (science 3.10). This linear system is solved directly. For a nonlinear body, Newton's
method solves it with the body's tangent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import Body, Response
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact, locate, turned
from cohaptic_server.world.displacement_field import Field, FreeField, ZeroField
from cohaptic_server.world.lags.turning import root_of_gain
from cohaptic_server.world.loads import Press, contact_axes, load_spans

# N for the forces, and 1e-8 m for the tips: a hundredth of the least force that counts
# (`state.NEGLIGIBLE`). Reasoned, not measured.
_TOLERANCE = 1e-5
# m along the surface. With the tolerance of a tick, a tip would be left 0.02 mm off a surface that
# others tilt by a third.
_CONTACT_TOLERANCE = 1e-6
# N; contacts are located to `_CONTACT_TOLERANCE` once forces change by less, which saves time.
# Reasoned, not measured.
_REFINE_BELOW = 1e-2
# Near an unstable equilibrium, such as that of a rubber plate between two hands just before it
# buckles, forces change by a few 1e-7 N in each iteration, and leave it in 40 more. Tips are
# therefore pushed by `_NUDGE` along the surface, and forces are found again more precisely. The
# forces may differ by the share `_SAME` of the largest one, or of `_LEAST` if that is more. The
# sizes are reasoned, not measured; test_equilibrium.py has the plate.
_NUDGE = 3e-4  # m, along each of two tangents
_FOUND_AGAIN = 1e-6  # N
_SAME, _LEAST = 1e-3, 0.1  # -, N
# Each half step halves an error, so that 200 find what can be found. Reasoned, not measured.
MAX_ITERATIONS = 200


@dataclass(frozen=True, slots=True)
class RestingHand:
    """A hand that holds still.

    Args:
        intention: Position that the hand wants for its tip [m].
        stiffness: Stiffness of the hand [N/m].
        start: Position from which the hand came [m], to touch the surface that the hand met first:
            in a wall pressed by more than its thickness, the surface nearest to the tip may be the
            far one. None to touch the nearest surface.
    """

    intention: Vec3
    stiffness: float
    start: Vec3 | None = None


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Forces of hands in equilibrium with the body.

    Args:
        force: Normal force on each hand, shape (c,) [N].
        alone: Force on each hand at the same tip if no other hand touched the body, (c,) [N].
        tip: Tip of each hand, shape (c, 3) [m].
        place: Contact point of each hand on the resting surface, shape (c, 3) [m].
        compliance: Compliance C between the contacts, shape (c, c) [m/N].
        turning: Largest ratio of a further shift of the contacts along the surface to a first one:
            the normals turn with the first shift, and body and hands yield to the turned forces.
            At 1 a tip slides off.
    """

    force: Floats
    alone: Floats
    tip: Floats
    place: Floats
    compliance: Floats
    turning: float

    @property
    def felt_from_others(self) -> Floats:
        """Part of each force that is due to the other hands, shape (c,) [N]."""
        return np.asarray(self.force - self.alone)


# One iteration needs nearly all of the state of the one before.
def solve(
    body: Body, hands: Sequence[RestingHand], iterations: int = MAX_ITERATIONS
) -> Equilibrium:
    """Find the equilibrium of a body and of hands without friction.

    For fixed contacts the forces solve a linear complementarity problem with a positive definite
    matrix, exactly. Then contacts are located again at the tips, until contacts and forces agree.
    The equilibrium is then disturbed once, and hands and body have to return to it: this test finds
    most unstable equilibria, but not all. A tip on top of a facet may stay there.

    Args:
        hands: All hands that touch the body.
        iterations: Number of iterations after which contacts that still slide are an error.

    Raises:
        BodyError: Contacts and forces do not converge.
    """
    n = len(hands)
    intention = np.array([hand.intention for hand in hands])
    hand_compliance = np.diag([1.0 / hand.stiffness for hand in hands])
    force = np.zeros(n)
    tip: Floats = intention.copy()
    free: list[Floats] = [np.zeros_like(body.mesh.vertices)] * n
    every = np.arange(len(body.mesh.vertices))
    contacts = [_first(body, hand) for hand in hands]
    response: Response | None = None
    tolerance: float | None = None
    before, limit = np.full(n, np.inf), _TOLERANCE
    for _ in range(iterations):
        located = _located(body, tip, free, contacts, tolerance)
        response = body.respond([c.load(f) for c, f in zip(located, force, strict=True)], response)
        # Depth of each intention below the resting surface, seen along the normal.
        bias = np.array([nonlinearity(c, response, i, force) for i, c in enumerate(located)])
        depth = (
            np.array([c.normal @ (c.point - intention[i]) for i, c in enumerate(located)]) - bias
        )
        solved = complementarity(response.compliance + hand_compliance, depth)
        change = _largest(solved - force)
        force = solved
        response = body.respond([c.load(f) for c, f in zip(located, force, strict=True)], response)
        normals = np.array([c.normal for c in located])
        stretch = force / np.array([hand.stiffness for hand in hands])
        pushed: Floats = intention + normals * stretch[:, None]
        # Half steps; with full ones, contacts among many neighbours oscillate across a face.
        tip = 0.5 * (tip + pushed)
        free = [
            0.5 * (previous + response.without(slice(i, i + 1), force[i : i + 1], every))
            for i, previous in enumerate(free)
        ]
        contacts = list(located)
        if change < _REFINE_BELOW and tolerance is None:
            tolerance = _CONTACT_TOLERANCE
        elif max(change, 1e3 * _largest(pushed - tip)) >= limit:
            continue
        elif _largest(force - before) > _SAME * max(_largest(force), _LEAST):
            before, limit = force, _FOUND_AGAIN
            aside = np.array([contact_axes(normal)[1:].sum(axis=0) for normal in normals])
            tip = tip + _NUDGE * (force > 0.0)[:, None] * aside
        else:
            C = response.compliance
            alone = _forces_alone(located, tip, C)
            turning = _turning(body, response, hands, located, force)
            places = np.array([c.point for c in located])
            return Equilibrium(force, alone, tip, places, C, turning)
    raise BodyError("body and hands found no equilibrium: the contacts keep sliding")


def _first(body: Body, hand: RestingHand) -> Contact | None:
    """Return the contact of a hand's `start` with the resting surface; None if it has no start."""
    if hand.start is None:
        return None
    return locate(body.mesh, hand.start, ZeroField(), radius=body.contact_radius)


def _located(
    body: Body,
    tip: Floats,
    free: Sequence[Floats],
    before: Sequence[Contact | None],
    tolerance: float | None,
) -> list[Contact]:
    """Find the contact of each hand with its free surface, in a search from its last contact."""
    radius = body.contact_radius
    return [
        locate(body.mesh, x, moved, radius=radius, hint=hint, tolerance=tolerance)
        for x, moved, hint in zip(tip, free, before, strict=True)
    ]


def _forces_alone(contacts: Sequence[Contact], tip: Floats, C: Floats) -> Floats:
    """Return the force on each hand at the same tip if it touched the body alone, (c,) [N]."""
    depth = np.array([c.normal @ (c.point - t) for c, t in zip(contacts, tip, strict=True)])
    return np.asarray(np.maximum(0.0, depth) / np.diag(C))


def _turning(
    body: Body,
    response: Response,
    hands: Sequence[RestingHand],
    contacts: Sequence[Contact],
    force: Floats,
) -> float:
    """Return the largest eigenvalue of S_tt (science 3.12), with each hand's own compliance."""
    pressing = np.flatnonzero(force > 0.0).tolist()
    if not pressing:
        return 0.0
    presses = [Press(contacts[i], float(force[i]), np.zeros(3)) for i in pressing]
    loads = [load for press in presses for load in press.loads()]
    C = body.respond(loads, response).compliance
    along = np.arange(3 * len(pressing)).reshape(-1, 3)[:, 1:].reshape(-1)
    between = C[np.ix_(along, along)].copy()
    root = np.zeros_like(between)
    for k, i in enumerate(pressing):
        own = slice(2 * k, 2 * k + 2)
        between[own, own] = np.eye(2) / hands[i].stiffness  # a contact's own dent does not turn it
        root[own, own] = root_of_gain(body.mesh, contacts[i]) / math.sqrt(C[3 * k, 3 * k])
    return float(np.linalg.eigvalsh(root @ between @ root.T)[-1])


def _largest(change: Floats) -> float:
    return float(np.abs(change).max(initial=0.0))


def nonlinearity(contact: Contact, response: Response, i: int, force: Floats) -> float:
    """Return the displacement of contact i against its normal, less C f [m].

    C is the compliance matrix of the response and f the forces; the result is 0 on a linear body.
    """
    moved = contact.normal @ (contact.moved(response.displacement) - contact.point)
    return float(-moved - response.compliance[i] @ force)


def complementarity(M: Floats, q: Floats) -> Floats:
    """Solve f >= 0, M f - q >= 0, f . (M f - q) = 0 for the vector f, shape (n,).

    Projected Gauss-Seidel finds the active set, on which the system is then solved exactly.

    Args:
        M: Symmetric positive definite matrix, shape (n, n).
        q: Right-hand side, shape (n,).
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


# N; upper bound of the change of any force in the last step. Newton's steps converge by squares, so
# that the next one would be below rounding.
_NEWTON_CHANGE = 1e-7
# More than Newton's method needs where it converges, which is a few. Reasoned, not measured.
_NEWTON_STEPS = 50
# Steps along the path of a hand, of which each is the gap that is left. Reasoned, not measured.
_MAX_TOUCH_DOWN_STEPS = 200
# m between a tip and the surface on which it has landed: 0.1 mN at 1000 N/m, below `NEGLIGIBLE`.
_GAP_TOLERANCE = 1e-7
# Cosine between the path and the inward normal; below it, from 84 degrees on, the path only grazes.
# Reasoned, not measured.
_MIN_FACING = 0.1


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
        normal: Outward unit normal of each hand's free surface, shape (n, 3).
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
    for _ in range(_NEWTON_STEPS):
        presses = [_press(h.contact, f) for h, f in zip(hands, force, strict=True)]
        response = body.respond([load for p in presses for load in p.loads()], response)
        residual = _tips(hands, force) - np.array(
            [_displaced(hand.contact, response) for hand in hands]
        )
        C = _in_space(response.compliance, presses)
        C += np.diag(np.repeat([1.0 / hand.stiffness for hand in hands], 3))
        change = -np.linalg.solve(C, residual.ravel()).reshape(n, 3)
        if np.abs(change).max() < _NEWTON_CHANGE:
            return StickingEquilibrium(force, _normals(body, hands, presses, response), response)
        force = force + change
    raise BodyError("body and hands that stick found no equilibrium")


def compliance_of(body: Body, hands: Sequence[StickingHand]) -> Floats:
    """Return the compliance between contacts on a resting body, world axes, (n, 3, n, 3) [m/N]."""
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
    """Return the position of each hand's tip under the force on it, shape (n, 3) [m]."""
    compliance = np.array([1.0 / hand.stiffness for hand in hands])
    return np.asarray(np.array([hand.intention for hand in hands]) + compliance[:, None] * force)


def _displaced(contact: Contact, response: Response) -> Floats:
    """Return the displaced position of the material point of a contact, shape (3,) [m]."""
    return np.asarray(contact.point + contact.weights @ response.displacement_of(contact.vertices))


def _in_space(compliance: Floats, presses: Sequence[Press]) -> Floats:
    """Transform a compliance matrix from contact axes to world axes, shape (3 n, 3 n) [m/N]."""
    axes = np.zeros(compliance.shape)
    for i, press in enumerate(presses):
        axes[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = press.axes
    return np.asarray(axes.T @ compliance @ axes)


def _normals(
    body: Body, hands: Sequence[StickingHand], presses: Sequence[Press], response: Response
) -> Floats:
    """Return the outward unit normal of each hand's free surface, shape (n, 3)."""
    normals: list[Floats] = []
    loads = [press.loads() for press in presses]
    for hand, own, span in zip(hands, loads, load_spans(loads), strict=True):
        forces = np.array([load.force for load in own])
        free = FreeField(response, forces, span)
        normals.append(turned(body.mesh, hand.contact, free).normal)
    return np.array(normals)
