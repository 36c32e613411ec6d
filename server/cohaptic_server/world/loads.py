"""The loads that users put on a body, and C between users.

A user without friction is one load, along the normal. One with friction is three, along the normal
and two tangents: the body then answers with the 3x3 compliance of the contact (`control.friction`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.control.friction import Compliance3, tangents
from cohaptic.protocol.patch import MIN_COMPLIANCE
from cohaptic_server.bodies.body import Load
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact


@dataclass(frozen=True, eq=False)
class Press:
    """What one user does to a body.

    Args:
        contact: Where.
        force: Normal [N].
        along: Force on the hand along the surface, shape (3,) [N]; None without friction.
    """

    contact: Contact
    force: float
    along: Floats | None = None

    @property
    def axes(self) -> Floats:
        """Normal, and with friction two tangents; unit vectors, shape (1 or 3, 3)."""
        n = self.contact.normal
        if self.along is None:
            return n[None]
        one, two = tangents((float(n[0]), float(n[1]), float(n[2])))
        return np.array([n, one, two])

    def loads(self) -> list[Load]:
        """One load for each of `axes`; the body gets the opposite of what the hand gets."""
        where = self.contact
        if self.along is None:
            return [where.load(self.force)]
        forces = [self.force, *(self.axes[1:] @ self.along).tolist()]
        return [
            Load(where.vertices, where.weights, -axis, force)
            for axis, force in zip(self.axes, forces, strict=True)
        ]


def spans(presses: Sequence[Press]) -> list[slice]:
    """Which of all loads are whose."""
    ends = np.cumsum([0] + [1 if press.along is None else 3 for press in presses]).tolist()
    return [slice(a, b) for a, b in itertools.pairwise(ends)]


def compliance_between(compliance: Floats, where: Sequence[slice]) -> Floats:
    """C between users as gains see it, shape (users, users) [m/N].

    On the diagonal the normal compliance. Off it the largest sum of |C| from any direction of the
    one to all directions of the other, in the share that the direction's own compliance has: a gain
    that is safe by this row is safe for every direction of a contact.

    Args:
        compliance: Between all loads of the users, shape (loads, loads) [m/N].
        where: Which loads are whose.
    """
    if not where:
        return np.zeros((0, 0))
    own = np.maximum(np.diag(compliance), 1e-300)
    first = np.array([mine.start for mine in where])
    owner = np.repeat(np.arange(len(where)), [mine.stop - mine.start for mine in where])
    share = own[first[owner]] / own
    sums = np.add.reduceat(np.abs(compliance), first, axis=1)  # (loads, users)
    rows = np.maximum.reduceat(share[:, None] * sums, first, axis=0)
    rows[np.diag_indices(len(where))] = own[first]
    return np.asarray(rows)


def floored(compliance: Floats, where: Sequence[slice]) -> Floats:
    """C of all loads of the users, with `MIN_COMPLIANCE` on the diagonal of what gives way less.

    What is held or hard is then a contact like any other, definite, and as stiff as the device. In
    three directions the smallest eigenvalue counts.

    Args:
        compliance: Between all loads, shape (loads or more, loads or more) [m/N].
        where: Which loads are whose.
    """
    loads = where[-1].stop if where else 0
    C = np.array(compliance[:loads, :loads])
    for span in where:
        block = C[span, span]
        lack = MIN_COMPLIANCE - float(np.diag(block).min())
        if len(block) > 1:
            least = max(MIN_COMPLIANCE, LEAST_SHARE * float(np.trace(block)))
            lack = least - float(np.linalg.eigvalsh(block)[0])
        if lack > 0.0:
            C[span, span] += lack * np.eye(span.stop - span.start)
    return C


def contact_compliance(compliance: Floats, press: Press, span: slice) -> Compliance3 | None:
    """The 3x3 compliance of a contact in the world frame; None without friction.

    Args:
        compliance: Between all loads, floored, shape (loads, loads) [m/N].
        press: Of the user.
        span: Its loads.
    """
    if press.along is None:
        return None
    axes = press.axes
    C = axes.T @ compliance[span, span] @ axes
    return Compliance3(*(float(C[i, j]) for i, j in _ENTRIES))


LEAST_SHARE = 1e-4  # of the trace: a direction that hardly gives way, in 32 bits on the wire
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
