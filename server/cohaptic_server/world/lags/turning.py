"""Time constant T_g that slows the turning of contacts by other users (science 3.12).

A probe at depth d [m] under a surface of curvature k [1/m] answers the forces of other users with
two springs: one of stiffness K along the normal, after the delay of the hand's loop, and one of
-K g along the surface, g = d k / (1 - d k), since the nearest point to the probe turns with the
surface. Let the coupling matrix S contain both directions of every contact: S_pp between the
normals, S_pt from tangents to normals, and S_tt between the tangents. With p and t, the answers
along normals and tangents, the delay T_i of hand i and the lag tau of the room, the loop is

    p = -A (S_pp p + S_pt t),    A = diag(exp(-s T_i) / (1 + s tau)),
    t = B (S_tp p + S_tt t),     B = 1 / (1 + s T_g).

**Theorem.** Let mu be the largest eigenvalue of -S_pp, w > 0 with cos(w T) - w tau sin(w T) >= mu
for T = T_max, a = 1 / sqrt(1 + w^2 tau^2) and b = 1 / sqrt(1 + w^2 T_g^2). If the largest
eigenvalue of S_tt is below 1, the loop is stable for all delays T_i <= T if E^(1/2) S E^(1/2) has a
norm below 1, where the diagonal matrix E has a for the normals and b for the tangents.

*Proof* in `docs/science.md`: below w the real parts of both springs are positive, above w the gain
of the loop is below one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cohaptic.control.stability.lag_choice import FRACTION
from cohaptic.protocol.patch import MIN_COMPLIANCE
from cohaptic_server.mesh.search.contact_search import MIN_SLOPE
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.world.contact import Contact, Contacts
from cohaptic_server.world.lags.room_loop import Hand, hand_stiffness
from cohaptic_server.world.loads import contact_axes

_BISECTIONS = 30  # gives frequency and share to 9 digits


def turning_needed(S: Floats, tangents: int, longest_delay: float, lag: float = 0.0) -> float:
    """Return the time constant T_g above which the theorem proves stability [s]; infinite if none.

    Args:
        S: Matrix sqrt|N| C sqrt|N| of all contacts, with their springs N (K or -K g) and compliance
            C, the tangents last; zero between directions of one contact; symmetric, shape (n, n).
        tangents: Number of rows of S that are tangents.
        longest_delay: Longest delay T_max of the theorem [s].
        lag: Lag tau of the room [s].
    """
    normals = len(S) - tangents
    if not tangents or not normals:
        return 0.0
    mu = max(0.0, -float(np.linalg.eigvalsh(S[:normals, :normals])[0]))
    if mu >= 1.0 or np.linalg.eigvalsh(S[normals:, normals:])[-1] >= 1.0:
        return math.inf
    w = _highest_passive(mu, longest_delay, lag)
    roots = np.full(len(S), 1.0 / math.hypot(1.0, w * lag) ** 0.5)

    def gain(b: float) -> float:
        roots[normals:] = math.sqrt(b)
        return float(np.abs(np.linalg.eigvalsh(S * roots[:, None] * roots)).max())

    if gain(1.0) < 1.0:
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        b = 0.5 * (low + high)
        low, high = (b, high) if gain(b) < 1.0 else (low, b)
    return math.sqrt(1.0 / (low * low) - 1.0) / w if low > 0.0 else math.inf


def _highest_passive(mu: float, delay: float, lag: float) -> float:
    """Return the highest frequency w [rad/s] with cos(w T) - w tau sin(w T) >= mu.

    Args:
        mu: As in the theorem, at least 0 and below 1.
        delay: Delay T [s].
        lag: Lag tau [s].
    """
    low, high = 0.0, math.acos(mu) / delay
    if lag == 0.0:
        return high
    for _ in range(_BISECTIONS):
        w = 0.5 * (low + high)
        passive = math.cos(w * delay) - w * lag * math.sin(w * delay) >= mu
        low, high = (w, high) if passive else (low, w)
    return low


# Upper bound of T_g, used where no T_g is proved stable because others turn a contact so far that
# it slips off: the time in which a hand lets go and comes back. Reasoned, not measured.
LONGEST_TURN = 2.0  # s
# Largest turning gain g that is neglected: that of a probe a quarter as deep as the radius of
# curvature, as in `displacement_field.LARGEST_PRODUCT`. For a larger gain, the body also computes
# its response along the two tangents of the contact.
LARGEST_TURN = 1.0 / 3.0
# Share of the spread of the vertices under a finger, which may lie on a line: above the rounding of
# doubles, and below what changes a curvature that can be fitted. Reasoned, not measured.
_TINY = 1e-9
GENTLE = 1.0 / (1.0 + LARGEST_TURN)  # smallest `Contact.slope` of a contact that is not steep


def steep_contacts(slopes: Floats) -> list[int]:
    """Return the rows of users whose contacts other users turn too fast; none for a single user.

    Args:
        slopes: `Contact.slope` of each contact, shape (n,).
    """
    if len(slopes) < 2:
        return []
    steep: list[int] = np.flatnonzero(slopes < GENTLE).tolist()
    return steep


class Turned(NamedTuple):
    """Loop of a room in which users turn each other's contacts.

    Args:
        S: Coupling matrix of all users' normals (p), followed by the tangents of turned contacts
            (t, science 3.12), symmetric, shape (users + tangents, users + tangents).
        tangents: Number of rows of S that are tangents.
    """

    S: Floats
    tangents: int

    @property
    def along(self) -> float:
        """Largest modulus of an eigenvalue of S_tt, the part of S between tangents.

        At an eigenvalue of 1 contacts slide off without any push. At -1 contacts turn each other to
        and fro from tick to tick, for ever; three hands round a limb reach -1 where two hands have
        1/2.
        """
        n = len(self.S) - self.tangents
        return float(np.abs(np.linalg.eigvalsh(self.S[n:, n:])).max())

    def answer(self) -> Floats:
        """Return the matrix V V^T that the answer of turned contacts adds to S, (users, users).

        It equals S_pt (1 - S_tt)^-1 S_tp; `along` must be below 1.
        """
        V = self.root_of_answer()
        return np.asarray(V @ V.T)  # (3.13) V V^T = S_pt (1 - S_tt)^-1 S_tp

    def root_of_answer(self) -> Floats:
        """Return V = S_pt (1 - S_tt)^(-1/2), the root of `answer`, shape (users, tangents)."""
        n = len(self.S) - self.tangents
        values, vectors = np.linalg.eigh(self.S[n:, n:])
        # (3.13) V = S_pt (1 - S_tt)^(-1/2), times an orthogonal matrix that no norm of V sees
        return np.asarray(self.S[:n, n:] @ (vectors / np.sqrt(1.0 - values)))

    def late(self, solve: Floats, dt: float) -> float:
        """Return the delay of the answers of turned contacts, T_b q of science 3.13 (d) [s].

        The surface of the previous tick turns a contact, and the effect of turned contacts on each
        other takes 1 / (1 - S_tt) ticks.

        Args:
            solve: Matrix (1 + X)^-1 of the anticipated part X of S, shape (users, users).
            dt: Simulation period N T [s].
        """
        V = self.root_of_answer()
        # (3.13 d) q = |V| |V^T (1 + X)^-1|
        norms = float(np.linalg.norm(V, 2) * np.linalg.norm(V.T @ solve, 2))
        # (3.13 d) T_b = N T / (1 - |lambda|_max), with N T = dt and |lambda|_max = `along`
        return dt / (1.0 - self.along) * norms


def turned_loop(
    users: Sequence[Hand],
    compliance: Floats,
    spans: Sequence[slice],
    contacts: Contacts,
    mesh: SurfaceMesh,
    pressing: Mask,
) -> Turned | None:
    """Return the loop of a room with the contacts that others turn; None if no contact is steep.

    Args:
        compliance: Compliance between all loads, shape (loads or more, loads or more) [m/N].
        spans: Span of each user's loads: one load, or three with those along the tangents.
        mesh: Resting surface.
        pressing: Whether the body carries a force of each user, shape (users,).
    """
    turned = [i for i in steep_contacts(contacts.slopes) if spans[i].stop - spans[i].start == 3]
    if not turned:
        return None
    first = np.array([span.start for span in spans])
    own = np.maximum(compliance.diagonal()[first], MIN_COMPLIANCE).tolist()
    fractions = [
        float(hand_stiffness(user, np.array([[c]]))[0, 0])
        for user, c in zip(users, own, strict=True)
    ]
    K = np.array(fractions) * pressing
    rows = np.concatenate([first, np.repeat(first[turned], 2) + np.tile([1, 2], len(turned))])
    owner = np.concatenate([np.arange(len(users)), np.repeat(turned, 2)])
    C = compliance[np.ix_(rows, rows)].copy()
    C[owner[:, None] == owner] = 0.0
    root = np.diag(np.sqrt(K[owner]))
    for k, i in enumerate(turned):
        own_rows = slice(len(users) + 2 * k, len(users) + 2 * k + 2)
        root[own_rows, own_rows] = np.sqrt(K[i]) * root_of_gain(mesh, contacts.contact(i))
    S = root @ C @ root
    return Turned(0.5 * (S + S.T), 2 * len(turned))


def find_turning_lag(turned: Turned | None, longest_delay: float, lag: float) -> float:
    """Choose the time constant with which contacts turn if nothing is anticipated [s].

    Args:
        turned: Loop of the room; None if no contact is steep.
        longest_delay: T_max, as in `RoomLoop` [s].
        lag: Lag tau of the room [s].
    """
    if turned is None:
        return 0.0
    needed = turning_needed(turned.S, turned.tangents, longest_delay, lag)
    return min(LONGEST_TURN, needed / FRACTION)


def root_of_gain(mesh: SurfaceMesh, contact: Contact) -> Floats:
    """Return the square root of a contact's turning gain g along its two tangents, shape (2, 2).

    The contact search measures the depth over the smallest radius of curvature only. The curvatures
    along both tangents are fitted to the resting normals under the finger, weighted by pressure.
    """
    axes = contact_axes(contact.normal)[1:]
    away = (mesh.vertices[contact.vertices] - contact.foot) @ axes.T
    turn = mesh.normals[contact.vertices] @ axes.T
    away -= contact.weights @ away
    turn -= contact.weights @ turn
    weighted = contact.weights[:, None] * away
    spread = away.T @ weighted
    floor = max(_TINY * float(np.trace(spread)), np.finfo(float).tiny)
    bend = np.linalg.solve(spread + floor * np.eye(2), weighted.T @ turn)
    curvature, directions = np.linalg.eigh(0.5 * (bend + bend.T))
    fraction = np.ones(2)  # the same in all directions where the surface bends outward in none
    if curvature[1] > 0.0:
        fraction = np.maximum(0.0, curvature) / curvature[1]
    product = fraction * (1.0 - max(contact.slope, MIN_SLOPE))
    return np.asarray((directions * np.sqrt(product / (1.0 - product))) @ directions.T)
