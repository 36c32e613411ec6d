"""Plan the next tick: the part of the coupling to anticipate (science 3.13), and the room's lag.

The room's lag follows from that part and from the loop that the hands close in one tick (science
3.8, 3.13).

If users turn each other's contacts, the anticipation includes the answer of the hand
(`known_coupling`) as if its contact turned with the body at once. In fact the contact turns with
the surface of the previous tick, and the lag has to allow for that (3.13 d). The part of the answer
that comes too late is V (1 - b(s)) V^T, with the matrix V, the low-pass b and its time T_b of
3.13 d, and |1 - b(i w)| <= w T_b. With q = |V| |V^T (1 + X)^-1|, where X is the anticipated part of
S, the loop of 3.13 is therefore stable if at every frequency w, with p = theta w,

    F(p)^(1/2) + h(p)^(1/2) q T_b w < (1 + (w tau)^2)^(1/2).

Here tau is the lag, and theta, F and h are those of 3.14: F is the square of a hand's largest gain
in its row of the loop, and h the square of its largest gain from the motion that it is shown. For
hands held still (F = c^2, h = 1, c = `Gains.held`) this is tau > q T_b / (1 - c^2)^(1/2).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cohaptic.control.room_lag import RoomLag
from cohaptic.control.stability.anticipation import (
    FREQUENCIES,
    UNCOUPLED,
    Gains,
    anticipated,
    hand_class,
    lag_of_hands,
)
from cohaptic.control.stability.lag_choice import (
    EXACT,
    FULL_BUDGET,
    choose_lag,
    coupling_radius,
    hand_time,
    margin,
)
from cohaptic.control.stability.swing import shown_gain, worst_row_gain
from cohaptic.protocol.patch import MAX_COUPLING, MAX_LAG
from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.room_loop import RoomLoop
from cohaptic_server.world.lags.turning import LONGEST_TURN, Turned
from cohaptic_server.world.loads import contact_axes
from cohaptic_server.world.state import NO_CAUSE, NOTHING, Anticipation, LagCause


def lag_where_turned(gains: Gains, damping_budget: float, stiffest: float, late: float) -> float:
    """Return the lag tau that keeps a room stable where users turn each other's contacts [s].

    The lag suffices for hands that hold still and for hands that move.

    Args:
        gains: Gains of the loop that anticipation leaves.
        damping_budget: Damping budget of the room's weakest device, Colgate's bound [N s/m].
        stiffest: Largest stiffness K of a hand, in any direction, finite [N/m].
        late: q T_b of the module's head, the delay of the answers of turned contacts [s].
    """
    theta, stiffness = hand_class(damping_budget, stiffest)
    frequency = FREQUENCIES / theta  # (3.13 d) w = p / theta
    # (3.13 d) F(p)^(1/2) + h(p)^(1/2) q T_b w < (1 + (w tau)^2)^(1/2), solved for tau at each w:
    # `row` is the left side, `worst_row_gain` F, `shown_gain` h, and `late` is q T_b
    row = np.sqrt(worst_row_gain(gains, FREQUENCIES, stiffness))
    row = row + np.sqrt(shown_gain(FREQUENCIES, stiffness)) * late * frequency
    moving = float(((row * row - 1.0) / (frequency * frequency)).max())
    # (3.13 d) tau > q T_b / (1 - c^2)^(1/2), hands held still
    held = late / math.sqrt(1.0 - gains.held * gains.held)
    return max(lag_of_hands(gains, damping_budget, stiffest), math.sqrt(max(0.0, moving)), held)


# Rounding error of the smallest eigenvalue, which is -1 for two hands on a rigid plate.
ROUNDING = 1e-6

# Time [s] for which the coupling must have been known before forces are anticipated. Each switch
# between anticipation and none moves contacts a little, and a contact that crosses the limit to
# and fro would keep swinging. As long as a hand takes to let go and come back. Reasoned, not
# measured.
CALM_TIME = LONGEST_TURN

# Largest modulus of an eigenvalue of S_tt, the coupling matrix between tangents, at which the
# answer of turned contacts counts as known. The answer grows as 1 / (1 - S_tt): at this limit an
# error of a tenth in how the surface bends becomes one of three tenths. Below -1 a contact that is
# turned a tick late oscillates, whatever lag the room has (science 3.13 d). The 2/3 is reasoned,
# not measured.
MAX_TURNED = 2.0 / 3.0

# Largest eigenvalue of V V^T = S_pt (1 - S_tt)^-1 S_tp at which the coupling counts as known: the
# share that turned contacts add to the effect of other users. The gain of a contact's normal, K g
# with g = 1 / slope - 1, grows without bound as the depth of a tip approaches the radius of
# curvature. There, the slope itself is known to within a half at best: on a lobe of rubber, it
# varied from 0.1 to 0.7 at one contact from tick to tick. Shares of 2 to 22 were anticipated, and
# forces of 0.95 N in place of 0.73 N came back once a second at a delay of 250 ms; with this limit
# two hands rest there (tests/system/test_rubber_lobe.py).
MAX_ANSWERED = 1.0


class Planned(NamedTuple):
    """Plan of one tick for the next: the anticipation, and the values that give the lag.

    Args:
        anticipation: Anticipation for the users in contact who already have a patch.
        gains: Gains of the loop that anticipation leaves; None if the coupling cannot be
            anticipated.
        m: Spectral radius of the coupling matrix S.
        late: Delay of the answers of turned contacts, from `Turned.late` [s].
    """

    anticipation: Anticipation
    gains: Gains | None
    m: float
    late: float = 0.0


def known_coupling(loop: RoomLoop, turned: Turned | None) -> Floats | None:
    """Return the coupling matrix S with the answer of turned contacts; None if it is not known.

    A hand answers displacements by others in two ways: its force along the normal changes, and its
    contact turns, which moves the body again (science 3.12). With a contact that turns in the same
    tick, both answers form one symmetric matrix, S_pp + S_pt (1 - S_tt)^-1 S_tp, with p for normals
    and t for tangents. A tick cannot know S if contacts are about to slide off or to turn each
    other to and fro, if turned contacts answer more than `MAX_ANSWERED`, or if others turn the
    contact of a finger that sticks.

    Args:
        loop: Loop along the normals.
        turned: Loop with the tangents of steep contacts; None if no contact is steep.
    """
    if turned is None or not len(loop.S):
        return loop.S
    if len(loop.S) != len(turned.S) - turned.tangents or turned.along > MAX_TURNED:
        return None
    answer = turned.answer()
    if float(np.linalg.eigvalsh(answer)[-1]) > MAX_ANSWERED:
        return None
    return np.asarray(loop.S + answer)  # (3.13) J = S_pp + V V^T


def find_anticipation(
    loop: RoomLoop, normals: Floats, S: Floats | None, turned: Turned | None, dt: float
) -> Planned:
    """Choose the part of a room's coupling that the next tick anticipates.

    Nothing is anticipated, and the room has the lag of science 3.8, if the coupling is not known or
    if a user in the loop has a law of the paper, which also answers the dent of its own force.

    Args:
        loop: Loop along the normals.
        normals: Normals of the users' contacts, shape (n, 3).
        S: Coupling matrix from `known_coupling`; None if that was None within the last `CALM_TIME`.
        turned: Loop with turned contacts; None if no contact is steep.
        dt: Simulation period N T [s].
    """
    if not len(loop.S):
        return Planned(NOTHING, UNCOUPLED, 0.0)
    if S is None or loop.paper_laws:
        return Planned(NOTHING, None, coupling_radius(loop.S))
    whole = anticipated(S)
    if whole.lowest < -1.0 - ROUNDING:  # a user chose such gains: nothing is proved
        return Planned(NOTHING, None, whole.radius)
    late = 0.0 if turned is None else turned.late(whole.solve, dt)
    # A user who has not answered a patch yet answers no change of the forces either.
    ticks = np.array([user.touch.tick for user in loop.users])
    here = np.flatnonzero(loop.inside & (ticks > 0))
    if len(here) < 2:
        return Planned(NOTHING, whole.gains, whole.radius, late)
    sizes = np.array([span.stop - span.start for span in loop.spans])
    part, owner = whole, np.repeat(np.arange(len(here)), sizes[here])
    if len(here) < len(sizes):
        rows = np.flatnonzero(np.isin(np.repeat(np.arange(len(sizes)), sizes), here))
        part = anticipated(S[np.ix_(rows, rows)], whole.gains.kappa)
    # (3.13) phi = K^(-1/2) f: in newtons X is K^(1/2) X K^(-1/2), and (1 + X)^-1 likewise; K^(1/2)
    # is `root`, of K in one direction or its Cholesky factor, as in `coupling_matrix`
    users = [loop.users[i].touch.user for i in here.tolist()]
    if len(owner) == len(here):  # no user has friction: one direction each
        axes = normals[here]
        root = np.sqrt(np.array([loop.stiffness[i][0, 0] for i in here.tolist()]))
        ratio = root[:, None] / root
        of, to = part.X * ratio, part.solve * ratio
    else:
        axes = np.empty((len(owner), 3))
        root, inverse = np.zeros_like(part.X), np.zeros_like(part.X)
        for k, i in enumerate(here.tolist()):
            own = owner == k
            axes[own] = contact_axes(normals[i])[: sizes[i]]
            block = np.ix_(own, own)
            root[block] = np.linalg.cholesky(loop.stiffness[i])
            inverse[block] = np.linalg.inv(root[block])
        of, to = root @ part.X @ inverse, root @ part.solve @ inverse
    plan = Anticipation(np.array(users), owner, axes, of, to)
    return Planned(plan, whole.gains, whole.radius, late)


# Rate at which the lag may fall [s per s] while the lag is below this value [s]; a longer lag falls
# by its own size per second. The lag may rise at once: the room needs the longer lag now, which
# only slows the forces on their way. If the lag fell at once, the forces that the lag still holds
# back would reach the body within one tick, as a jump. The 0.2 is reasoned, not measured: the lag
# of two hands on the balloon, 34 ms, is gone in 0.2 s.
FALL_RATE = 0.2


def find_lag(
    loop: RoomLoop, plan: Planned, previous: RoomLag, cause: LagCause, dt: float
) -> tuple[RoomLag, LagCause]:
    """Choose the room's lag for the next tick, with its stability margin, and find its cause.

    Args:
        loop: Loop along the normals.
        plan: Plan of this tick for the next.
        previous: Lag of the last tick.
        cause: Cause of that lag; it remains the cause while the lag falls.
        dt: Time since the last tick [s].
    """
    # The gains of the paper's laws are chosen for any delay; such users need no lag.
    needed, m, gains, slow = 0.0, plan.m, plan.gains, False
    if gains is not None:
        hands = (gains, loop.damping_budget, loop.stiffest)
        needed = lag_where_turned(*hands, plan.late) if plan.late else lag_of_hands(*hands)
    elif loop.predictive:
        needed = choose_lag(m, loop.longest_delay, loop.damping_budget).lag
        slow = needed > hand_time(loop.damping_budget, m) * m
    lag = max(needed, previous.lag - max(FALL_RATE, previous.lag) * dt)
    if lag == needed:
        cause = NO_CAUSE
        if needed > 0.0 and slow:
            cause = LagCause("delay", loop.slowest)
        elif needed > 0.0 and loop.damping_budget < FULL_BUDGET:
            cause = LagCause("damping", loop.weakest)
    # A lag beyond the range of the wire is cut to it, so that patches still go out; the margin
    # then shows that it is too short.
    lag = min(MAX_LAG, lag)
    edge = margin(m, loop.longest_delay, lag)
    if gains is not None:
        edge = 1.0 / gains.held if gains.held > EXACT else float("inf")
    return RoomLag(lag, min(MAX_COUPLING, m), edge), cause
