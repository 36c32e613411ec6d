"""The loads that users put on a body, and the compliance C between users.

A user without friction is one load, along the normal. A user with friction is three, along the
normal and two tangents, so that the body answers with the 3x3 compliance of the contact
(`control.friction`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.control.friction import Compliance3, tangents
from cohaptic.protocol.patch import MAX_COMPLIANCE, MIN_COMPLIANCE
from cohaptic_server.bodies.body import Load
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact

# Smallest eigenvalue of a contact's 3x3 compliance over its trace: a direction that hardly gives
# way must still be resolved in the 32 bits of the wire.
MIN_EIGENVALUE_SHARE = 1e-4
# Trace of a contact's compliance that leaves room for raising its smallest eigenvalue [m/N].
_MAX_TRACE = MAX_COMPLIANCE * (1.0 - 2.0 * MIN_EIGENVALUE_SHARE)
_UPPER_TRIANGLE = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # order of `Compliance3`


@dataclass(frozen=True, eq=False)
class Press:
    """Contact and force of one user on the body.

    Args:
        contact: On the surface.
        force: Normal force [N].
        tangential: Tangential force on the hand, shape (3,) [N]; None without friction.
    """

    contact: Contact
    force: float
    tangential: Floats | None = None

    @property
    def axes(self) -> Floats:
        """Normal, and with friction two tangents; unit vectors, shape (1 or 3, 3)."""
        n = self.contact.normal
        if self.tangential is None:
            return n[None]
        one, two = tangents((float(n[0]), float(n[1]), float(n[2])))
        return np.array([n, one, two])

    def loads(self) -> list[Load]:
        """One load for each of `axes`; the body gets the opposite of the force on the hand."""
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
    """Position of each user's loads among those of all users, concatenated."""
    ends = np.cumsum([0] + [len(own) for own in loads]).tolist()
    return [slice(start, stop) for start, stop in itertools.pairwise(ends)]


def compliance_between(compliance: Floats, spans: Sequence[slice]) -> Floats:
    """C between users for the choice of gains, shape (users, users) [m/N].

    On the diagonal stands the normal compliance of each contact. Off it stands the largest sum of
    |C| from any direction of the one contact to all directions of the other, scaled by normal
    compliance over that direction's own: a gain that is safe by this row is safe for every
    direction of a contact.

    Args:
        compliance: Between all loads of the users, shape (loads, loads) [m/N].
        spans: Loads of each user.
    """
    if not spans:
        return np.zeros((0, 0))
    own = np.maximum(compliance.diagonal(), 1e-300)
    if len(spans) == len(compliance):  # nobody has friction: one direction each
        rows = np.abs(compliance)
        np.fill_diagonal(rows, own)
        return rows
    first = np.array([span.start for span in spans])
    owner = np.repeat(np.arange(len(spans)), [span.stop - span.start for span in spans])
    share = own[first[owner]] / own
    sums = np.add.reduceat(np.abs(compliance), first, axis=1)  # (loads, users)
    rows = np.maximum.reduceat(share[:, None] * sums, first, axis=0)
    rows[np.diag_indices(len(spans))] = own[first]
    return np.asarray(rows)


def bounded(compliance: Floats, spans: Sequence[slice]) -> Floats:
    """C of all loads of the users, its diagonal from `MIN_COMPLIANCE` to `MAX_COMPLIANCE` [m/N].

    A contact on a fixed or very stiff place then has a positive definite compliance like any other,
    and is as stiff as a device can show. In three directions the smallest eigenvalue is raised. A
    place that is too soft to be felt is made less so, in all of its rows and columns alike.

    Args:
        compliance: Between all loads, shape (loads or more, loads or more) [m/N].
        spans: Loads of each user.
    """
    loads = spans[-1].stop if spans else 0
    C = np.array(compliance[:loads, :loads])
    if C.diagonal().max(initial=0.0) > MAX_COMPLIANCE / 3.0:
        C *= _softest(C, spans)
    if loads == len(spans):  # nobody has friction: one direction each
        np.fill_diagonal(C, np.maximum(C.diagonal(), MIN_COMPLIANCE))
        return C
    for span in spans:
        block = C[span, span]
        lack = MIN_COMPLIANCE - float(np.diag(block).min())
        if len(block) > 1:
            floor = max(MIN_COMPLIANCE, MIN_EIGENVALUE_SHARE * float(np.trace(block)))
            lack = floor - float(np.linalg.eigvalsh(block)[0])
        if lack > 0.0:
            C[span, span] += lack * np.eye(span.stop - span.start)
    return C


def _softest(C: Floats, spans: Sequence[slice]) -> Floats:
    """Factors of C that bring each contact within `MAX_COMPLIANCE`, whatever its axes are.

    The largest compliance of three directions in any axes is at most their trace.
    """
    root = np.ones(len(C))
    for span in spans:
        most = float(C.diagonal()[span].sum())
        root[span] = np.sqrt(_MAX_TRACE / max(most, _MAX_TRACE))
    return np.asarray(root[:, None] * root)


def contact_compliance(compliance: Floats, press: Press, span: slice) -> Compliance3 | None:
    """The 3x3 compliance of a contact in the world frame; None without friction.

    Args:
        compliance: Between all loads, bounded, shape (loads, loads) [m/N].
        press: Of the user.
        span: Its loads.
    """
    if press.tangential is None:
        return None
    axes = press.axes
    C = axes.T @ compliance[span, span] @ axes
    return Compliance3(*(float(C[i, j]) for i, j in _UPPER_TRIANGLE))
