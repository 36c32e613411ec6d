"""A stage of a tick, and the tick that all stages work on.

A stage reads what those before it wrote, under names, and writes its own. `chain.py` has their
order. All stages compute with the arrays of `users.py`: row i of each belongs to the same user.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from cohaptic.control.friction import Compliance3
from cohaptic.control.room_lag import RoomLag
from cohaptic.protocol.partners import Partners
from cohaptic.protocol.patch import Patch
from cohaptic_server.bodies.body import Response
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.world.lags.planning import Planned
from cohaptic_server.world.lags.room_loop import RoomLoop
from cohaptic_server.world.lags.turning import Turned
from cohaptic_server.world.state import Carried, LagCause, Release, TickTime, Touch
from cohaptic_server.world.users import Applied, Hand, Observed, Tracked, Wishes, WorldState


@dataclass(eq=False, slots=True)
class Tick:
    """A tick while it is made; the only thing that stages change.

    Given:
        touched_body: The deformable object and its touch mesh.
        state: The world after the last tick.
        connected: Newest sample of every user who gets a patch, by number.
        time: Number, time and period of this tick.
        max_move: Largest distance that a hand can move a contact since the last tick [m].

    Written by the stage `presence`:
        touches: Newest samples of the n users who take part.
        before: Row of each in the last tick; -1 for a user who was not there, shape (n,).
        presence: Share of each user's force that counts, 0 to 1, shape (n,).

    By `track`:
        tracked: The users with their contacts and the forces that they request there.

    By `release`:
        rows: As `before`; -1 also for a user whose contact jumped, shape (n,).
        jumped: Whether any row is -1.
        releases: Forces that fade at contacts from which their probes have jumped.
        present: 1 for users who press at their contact, 0 for those whose force still fades at a
            former one, shape (n,).
        previous: Normal force of each user in the last tick, at this contact, shape (n,) [N].
        force: Normal force of each user at this contact, shape (n,) [N]. The stages from `limit`
            to `rate` change it into the force that the body carries.
        was, along: Tangential force of each user in the last tick and now, shape (n, 3) [N]. The
            same stages change the latter.

    By `limit`:
        C: Compliance between the contacts in the last tick, as far as known, shape (n, n) [m/N].
        max_force: Largest force of each contact, shape (n,) [N].
        limited: Normal force of each user within all limits, shape (n,) [N].

    By `anticipate`:
        ahead: Normal force that each user is about to have, shape (n,) [N].

    By `lag`:
        lagged: Normal force of each user behind the lag, shape (n,) [N].

    By `rate`:
        applied: The forces that the body carries.
        ledger: What the stages from `presence` to `rate` added to the forces in the samples, one
            row for each entry in newtons of `TickLedger`, shape (5, n) [N].

    By `respond`:
        turns: Rows of the users whose contacts are steep.
        starts: First load of each user, and the end of the last user's loads, shape (n + 1,).
        loads: Forces of the users' loads, shape (l,) [N].
        wide: Rows of the users with three loads.
        response: Response of the body; `swing` chooses what is shown of it.

    By `observe`:
        delays: Loop delay of each user [s].
        observed: Free surfaces of the users.
        height: Height of each probe over its free surface, shape (n,) [m].
        near: Weight of each user as a neighbour, 0 to 1, shape (n,).

    By `couple`:
        compliance: Compliance between the loads of the loop [m/N].
        spans: Span of each user's loads in it.
        coupling: Compliance between the contacts, shape (n, n) [m/N].
        hands: Users with samples and delays.
        pressing: Whether the body carries a force of each user, shape (n,).
        loop: The loop that the pressing hands close.
        turned: The same with contacts that turn each other; None if no contact is steep.

    By `plan`:
        past: Forces that the body carried in ticks that samples may still answer.
        plan: Part of the coupling that the next tick anticipates.
        room, cause: The room's lag for the next tick, and why it is so long.
        turning: Time constant of the lag with which others turn a steep contact [s].
        unknown_at: Last time at which the coupling was not known [s].

    By `models`:
        stiffest: Largest gain of each user's law, shape (n,) [N/m].
        wishes: What the hands want.
        partners: The other hands, for each user whose client moves models.

    By `patches`:
        k_o_coupled: Coupling-aware stiffness of each user [N/m].
        of_contacts: 3x3 compliance of each contact; None without friction.
        patches: Patch of each connected user.
    """

    touched_body: TouchedBody
    state: WorldState
    connected: Mapping[int, Touch]
    time: TickTime
    max_move: float
    touches: list[Touch] = field(init=False)
    before: Ints = field(init=False)
    presence: Floats = field(init=False)
    tracked: Tracked = field(init=False)
    rows: Ints = field(init=False)
    jumped: bool = field(init=False)
    releases: tuple[Release, ...] = field(init=False)
    present: Floats = field(init=False)
    previous: Floats = field(init=False)
    force: Floats = field(init=False)
    was: Floats = field(init=False)
    along: Floats = field(init=False)
    C: Floats = field(init=False)
    max_force: Floats = field(init=False)
    limited: Floats = field(init=False)
    ahead: Floats = field(init=False)
    lagged: Floats = field(init=False)
    applied: Applied = field(init=False)
    ledger: Floats = field(init=False)
    turns: Sequence[int] = field(init=False)
    starts: Ints = field(init=False)
    loads: Floats = field(init=False)
    wide: Sequence[int] = field(init=False)
    response: Response = field(init=False)
    delays: list[float] = field(init=False)
    observed: Observed = field(init=False)
    height: Floats = field(init=False)
    near: Floats = field(init=False)
    compliance: Floats = field(init=False)
    spans: Sequence[slice] = field(init=False)
    coupling: Floats = field(init=False)
    hands: list[Hand] = field(init=False)
    pressing: Mask = field(init=False)
    loop: RoomLoop = field(init=False)
    turned: Turned | None = field(init=False)
    past: tuple[Carried, ...] = field(init=False)
    plan: Planned = field(init=False)
    room: RoomLag = field(init=False)
    cause: LagCause = field(init=False)
    turning: float = field(init=False)
    unknown_at: float = field(init=False)
    stiffest: Floats = field(init=False)
    wishes: Wishes = field(init=False)
    partners: Mapping[int, Partners] = field(init=False)
    k_o_coupled: list[float] = field(init=False)
    of_contacts: list[Compliance3 | None] = field(init=False)
    patches: dict[int, Patch] = field(init=False)


class Stage(NamedTuple):
    """One thing that happens to the forces of all users in a tick.

    Fields:
        name: Name of the stage, as ledger and documents have it.
        run: What it does to a tick.
        reason: What it does and why, in a sentence.
        constant: Name of the constant with which it works, and its unit; empty for none.
    """

    name: str
    run: Callable[[Tick], None]
    reason: str
    constant: str = ""
