"""The loads that users put on a body, and the compliance matrix C between these loads.

A user without friction has one load, along the normal. A user with friction has three loads, along
the normal and two tangents, so that the body answers with the 3x3 compliance of the contact
(`control.friction`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.control.friction import Compliance3, tangents
from cohaptic.protocol.patch import MAX_COMPLIANCE, MIN_COMPLIANCE
from cohaptic_server.bodies.body import Load, LoadArrays, Loads
from cohaptic_server.numeric import Floats, Ints, vec3
from cohaptic_server.world.contact import Contact, Contacts

# Smallest eigenvalue of a contact's 3x3 compliance over its trace: a direction that hardly gives
# way must still be resolved in the 32 bits of the wire, whose rounding is 6e-8: to a thousandth.
MIN_EIGENVALUE_FRACTION = 1e-4
# Trace of a contact's compliance that leaves room for raising its smallest eigenvalue [m/N].
_MAX_TRACE = MAX_COMPLIANCE * (1.0 - 2.0 * MIN_EIGENVALUE_FRACTION)
_UPPER_TRIANGLE = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # order of `Compliance3`


@dataclass(frozen=True, eq=False)
class Press:
    """Contact and force of one user on the body.

    Args:
        force: Normal force [N].
        tangential: Tangential force on the hand, shape (3,) [N]; None without friction.
    """

    contact: Contact
    force: float
    tangential: Floats | None = None

    @property
    def axes(self) -> Floats:
        """Unit vectors of the loads: the normal, with friction also two tangents, (1 or 3, 3)."""
        n = self.contact.normal
        if self.tangential is None:
            return n[None]
        return contact_axes(n)

    def loads(self) -> list[Load]:
        """Return one load for each of `axes`; a load is the opposite of the force on the hand."""
        contact = self.contact
        if self.tangential is None:
            return [contact.load(self.force)]
        axes = self.axes
        forces = [self.force, *(axes[1:] @ self.tangential).tolist()]
        return [
            Load(contact.vertices, contact.weights, -axis, force)
            for axis, force in zip(axes, forces, strict=True)
        ]


def load_spans(loads: Sequence[Sequence[Load]]) -> list[slice]:
    """Return the span of each user's loads among the concatenated loads of all users."""
    ends = np.cumsum([0] + [len(own) for own in loads]).tolist()
    return [slice(start, stop) for start, stop in itertools.pairwise(ends)]


def loads_of(
    contacts: Contacts,
    forces: Floats,
    tangential: Floats,
    frictional: Sequence[int],
    others: Sequence[Press],
) -> tuple[Loads, Ints]:
    """Return the loads of all users, followed by the loads of fading forces.

    Args:
        contacts: Contacts of the users.
        forces: Normal force of each user, shape (n,) [N].
        tangential: Tangential force on each hand, shape (n, 3) [N].
        frictional: Rows of users who may have a tangential force, or whose compliance along the
            surface is needed.
        others: Forces that fade at contacts which their users have left.

    Returns:
        The loads; and the index of each user's first load, followed by the end of the last user's
        loads, shape (n + 1,).
    """
    n = len(forces)
    spans = np.arange(n + 1)
    starts, ends, directions = contacts.starts[:-1], contacts.starts[1:], -contacts.normals
    if frictional:
        directions_of = np.ones(n, dtype=np.int64)
        directions_of[list(frictional)] = 3
        owner = np.repeat(np.arange(n), directions_of)
        spans = np.searchsorted(owner, spans)
        starts, ends, directions = starts[owner], ends[owner], directions[owner]
        forces = forces[owner]
        for i in frictional:
            own = slice(spans[i], spans[i + 1])
            axes = contact_axes(contacts.frames[i, 2])
            directions[own] = -axes
            forces[own.start + 1 : own.stop] = axes[1:] @ tangential[i]
    arrays = LoadArrays(starts, ends, contacts.vertices, contacts.weights, directions, forces)
    if others:
        more = LoadArrays.of([load for press in others for load in press.loads()])
        first = len(contacts.vertices)
        arrays = LoadArrays(
            np.concatenate([starts, more.starts + first]),
            np.concatenate([ends, more.ends + first]),
            np.concatenate([contacts.vertices, more.vertices]),
            np.concatenate([contacts.weights, more.weights]),
            np.concatenate([directions, more.directions]),
            np.concatenate([forces, more.forces]),
        )
    return Loads(arrays), spans


def contact_axes(normal: Floats) -> Floats:
    """Return the normal of a contact and two tangents as unit vectors, shape (3, 3)."""
    return np.array([normal, *tangents(vec3(normal))])


def without_tangents(
    compliance: Floats, spans: Sequence[slice], users: Sequence[int]
) -> tuple[Floats, list[slice]]:
    """Return the compliance matrix C without the tangential loads of some users.

    Args:
        compliance: C between all loads, shape (loads or more, loads or more) [m/N].
        spans: Span of each user's loads.
        users: Rows of the users of whom only the load along the normal stays, as without friction.

    Returns:
        C between the loads that stay, and the span of each user's loads in it.
    """
    if not users:
        return compliance, list(spans)
    left = [span.start + 1 if i in users else span.stop for i, span in enumerate(spans)]
    kept = [range(span.start, stop) for span, stop in zip(spans, left, strict=True)]
    rows = np.array([k for own in kept for k in own])
    ends = np.cumsum([0] + [len(own) for own in kept]).tolist()
    return compliance[np.ix_(rows, rows)], [slice(a, b) for a, b in itertools.pairwise(ends)]


def compliance_between(compliance: Floats, spans: Sequence[slice]) -> Floats:
    """Return a compliance between users that is safe for the choice of gains, (users, users) [m/N].

    The diagonal holds the normal compliance of each contact. For any other entry, |C| is summed
    from one direction of the first contact to all directions of the second, and multiplied by the
    ratio of the first contact's normal compliance to that direction's own; the entry is the largest
    such value. A gain that is safe by this row is therefore safe for every direction of a contact.

    Args:
        compliance: Compliance C between all loads of the users, shape (loads, loads) [m/N].
        spans: Span of each user's loads.
    """
    if not spans:
        return np.zeros((0, 0))
    own = np.maximum(compliance.diagonal(), 1e-300)
    if len(spans) == len(compliance):  # no user has friction: one direction each
        rows = np.abs(compliance)
        rows.reshape(-1)[:: len(rows) + 1] = own  # its diagonal
        return rows
    first = np.array([span.start for span in spans])
    owner = np.repeat(np.arange(len(spans)), [span.stop - span.start for span in spans])
    fraction = own[first[owner]] / own
    sums = np.add.reduceat(np.abs(compliance), first, axis=1)  # (loads, users)
    rows = np.maximum.reduceat(fraction[:, None] * sums, first, axis=0)
    rows[np.diag_indices(len(spans))] = own[first]
    return np.asarray(rows)


def bounded(compliance: Floats, spans: Sequence[slice]) -> Floats:
    """Return the compliance matrix C of the users' loads with a bounded diagonal [m/N].

    The bounds are `MIN_COMPLIANCE` and `MAX_COMPLIANCE`. A contact on a fixed or very stiff part
    then has a positive definite compliance like any other contact, and is as stiff as a device can
    display. For a contact with three loads, the smallest eigenvalue of its block is raised. A
    contact too soft to be felt is made stiffer, by one factor in all its rows and columns.

    Args:
        compliance: C between all loads, shape (loads or more, loads or more) [m/N].
        spans: Span of each user's loads.
    """
    loads = spans[-1].stop if spans else 0
    C = np.array(compliance[:loads, :loads], order="C")
    own = C.reshape(-1)[:: loads + 1]  # its diagonal
    if own.max(initial=0.0) > MAX_COMPLIANCE / 3.0:
        C *= _softest(C, spans)
    if loads == len(spans):  # no user has friction: one direction each
        np.maximum(own, MIN_COMPLIANCE, out=own)
        return C
    for span in spans:
        block = C[span, span]
        lack = MIN_COMPLIANCE - float(np.diag(block).min())
        if len(block) > 1:
            floor = max(MIN_COMPLIANCE, MIN_EIGENVALUE_FRACTION * float(np.trace(block)))
            lack = floor - float(np.linalg.eigvalsh(block)[0])
        if lack > 0.0:
            C[span, span] += lack * np.eye(span.stop - span.start)
    return C


def _softest(C: Floats, spans: Sequence[slice]) -> Floats:
    """Return factors of C that bring each contact within `MAX_COMPLIANCE`, shape (loads, loads).

    The largest compliance of a contact in any direction is at most the trace of its 3x3 compliance,
    whatever axes the loads have.
    """
    root = np.ones(len(C))
    for span in spans:
        limit = float(C.diagonal()[span].sum())
        root[span] = np.sqrt(_MAX_TRACE / max(limit, _MAX_TRACE))
    return np.asarray(root[:, None] * root)


def contact_compliance(compliance: Floats, normal: Floats, span: slice) -> Compliance3 | None:
    """Return the 3x3 compliance of a contact in world axes; None without friction.

    Args:
        compliance: Compliance between all loads, bounded, shape (loads, loads) [m/N].
        normal: Normal of the contact, shape (3,).
        span: Span of the contact's loads: one, or three with friction.
    """
    if span.stop - span.start == 1:
        return None
    axes = contact_axes(normal)
    C = axes.T @ compliance[span, span] @ axes
    return Compliance3(*(float(C[i, j]) for i, j in _UPPER_TRIANGLE))
