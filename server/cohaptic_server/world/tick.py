"""Advances the world by one simulation period: takes forces, returns patches. No I/O.

What happens in a tick is the list in `stages/chain.py`. Each stage is one call for all users, over
the arrays of `users.py` (docs/design/wire.md).

The force of a user who has left, or whose samples have stopped, fades over `RELEASE_TIME`, so that
a pulled cable makes no other user's force jump. When no user, response or fading force is left, the
world is at rest, and a tick without touches changes only its number (`users.settled`).
"""

from __future__ import annotations

from collections.abc import Iterable

from cohaptic.protocol.patch import Patch
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.stages.chain import CHAIN
from cohaptic_server.world.stages.stage import Tick
from cohaptic_server.world.state import TickTime, Touch
from cohaptic_server.world.users import Users, WorldState, is_at_rest, pass_over, settled

# A contact that moves further than both of these in a tick was not moved by a hand. The first is
# for high rates, at which one sample may be several ticks late; reasoned, not measured.
_MAX_STEP = 0.03  # m
_MAX_SPEED = 1.5  # m/s, the speed at which a client's safety layer lets go
# Periods; a server that stood still for longer has not computed what would have happened meanwhile.
# A few late ticks are made up for. Reasoned, not measured.
_LONGEST_TICK = 4.0
_SHORTEST_TICK = 0.1  # periods; filters divide by a time. Reasoned, not measured.


def advance(
    touched_body: TouchedBody,
    state: WorldState,
    touches: Iterable[Touch],
    *,
    now: float,
    dt: float,
    elapsed: float | None = None,
) -> tuple[WorldState, dict[int, Patch]]:
    """Advance the world by one simulation tick.

    Args:
        touched_body: The deformable object and its touch mesh.
        state: The world after the last tick.
        touches: Newest sample of every connected user who has sent one.
        now: Time of this tick on the server's clock [s].
        dt: Simulation period N T [s].
        elapsed: Time since the last tick [s]; None for a tick on time. Whatever moves with time
            moves by this, so that a late tick changes nothing but the times at which hands see it.
            A body with a memory has its own constant period.

    Returns:
        The world after this tick, and a patch for each of `touches`, by user.
    """
    connected = {touch.user: touch for touch in touches}
    if not connected and is_at_rest(state):
        return pass_over(state, 1), {}
    elapsed = dt if elapsed is None else max(_SHORTEST_TICK * dt, min(_LONGEST_TICK * dt, elapsed))
    time = TickTime(state.tick + 1, now, dt, elapsed)
    tick = Tick(touched_body, state, connected, time, _max_contact_move(touched_body.body, elapsed))
    for stage in CHAIN:
        stage.run(tick)
    users = Users(tick.tracked, tick.applied, tick.observed, tick.of_contacts, tick.k_o_coupled)
    after = WorldState(
        time.number, users, tick.response, tick.releases, tick.room, tick.coupling, tick.turning,
        tick.plan.anticipation, tick.past, tick.unknown_at, tick.cause, tick.wishes,
    )  # fmt: skip
    return settled(after, now), tick.patches


def _max_contact_move(body: Body, dt: float) -> float:
    """Return the largest distance that a hand can move a contact in a tick [m]."""
    return max(_MAX_STEP, _MAX_SPEED * dt) + body.contact_radius
