"""Stages at the end of a tick: what the models of the hands may do, and the patch of each user."""

from __future__ import annotations

from functools import partial

import numpy as np

from cohaptic.control.friction import Compliance3
from cohaptic.control.gains import choose_gains
from cohaptic.control.tick_ledger import TickLedger
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import is_linear
from cohaptic_server.numeric import Floats
from cohaptic_server.world.loads import contact_compliance
from cohaptic_server.world.partners.wishes import (
    NO_PARTNERS,
    held_beside,
    moves_models,
    next_wishes,
    partners_of,
)
from cohaptic_server.world.patch_geometry import free_shapes
from cohaptic_server.world.stages.stage import Tick


def move_models(tick: Tick) -> None:
    """Find what the hands want whose models clients move (science 3.15)."""
    tracked, applied = tick.tracked, tick.applied
    tick.wishes, tick.partners = tick.state.wishes, NO_PARTNERS
    tick.stiffest = tracked.settings[1]
    if not tick.wishes.hands and not moves_models(tracked):
        return
    normals = np.array([span.start for span in tick.spans], dtype=np.int64)
    C = tick.compliance[np.ix_(normals, normals)]
    body = tick.touched_body.body
    linear = not tick.turns and is_linear(body)
    beside = held_beside(tracked, tick.wishes, tick.pressing, C)
    tick.stiffest = 1.0 / (1.0 / tick.stiffest + beside)
    tick.wishes = next_wishes(
        tick.wishes, tracked, applied, tick.height, C, tick.stiffest, linear, tick.time
    )
    tick.partners = partners_of(
        tick.wishes, tracked, applied, tick.near, C, tick.stiffest, body.mesh.size
    )


def build_patches(tick: Tick) -> None:
    """Build the patch of each connected user, with the geometry that its client requests."""
    tracked, applied, time = tick.tracked, tick.applied, tick.time
    weighted = _weighted_rows(tick.coupling, tick.near)
    rows, stiffest = weighted.tolist(), tick.stiffest.tolist()
    tick.k_o_coupled = (1.0 / np.abs(weighted).sum(axis=1)).tolist()
    of_contacts: list[Compliance3 | None] = [None] * len(tick.spans)
    for i in tracked.frictional:
        normal = tracked.contacts.frames[i, 2]
        of_contacts[i] = contact_compliance(tick.compliance, normal, tick.spans[i])
    tick.of_contacts = of_contacts
    frames, x_free = tracked.contacts.frames, tick.observed.x_free
    normals = np.ascontiguousarray(frames[:, 2])
    curvatures, neighbourhoods = free_shapes(
        tick.touched_body, tick.observed.windows, tick.observed.free, x_free, normals
    )
    own = applied.force[:, None] * normals
    if tracked.frictional:
        own += applied.tangential
    places, normal_of, force = _tuples(x_free), _tuples(normals), _tuples(own)
    by_others, curved = _tuples(x_free - frames[:, 1]), curvatures.tolist()
    devices, cut = tracked.settings[1].tolist(), tick.ledger.T.tolist()
    patches: dict[int, Patch] = {}
    for i, (touch, delay) in enumerate(zip(tracked.touches, tick.delays, strict=True)):
        who = touch.who
        if who.user not in tick.connected:
            continue
        choose = partial(
            choose_gains,
            who.law,
            rows[i],
            i,
            # The room's lag is part of the loop of the paper's laws.
            loop_delay=delay + tick.room.lag,
            simulation_period=time.period,
            fixed=who.fixed_gains,
        )
        gains = choose(max_stiffness=stiffest[i])
        if stiffest[i] < devices[i]:
            cut[i].append(max(0.0, choose(max_stiffness=devices[i]).k_h - gains.k_h))
        # Arguments by position: keywords would take twice as long.
        patches[who.user] = Patch(
            time.number, touch.seq, time.now, touch.t_client, max(0.0, time.now - touch.arrived),
            who.geometry, who.law, places[i], normal_of[i], curved[i], rows[i][i], gains.k_h,
            gains.integral_gain, force[i], by_others[i], tick.room, neighbourhoods[i],
            of_contacts[i], tick.partners.get(who.user), TickLedger(*cut[i]),
        )  # fmt: skip
    tick.patches = patches


def _weighted_rows(coupling: Floats, near: Floats) -> Floats:
    """Return the compliance between users, entries off the diagonal weighted by nearness [m/N]."""
    rows = coupling * near
    rows.reshape(-1)[:: len(rows) + 1] = coupling.diagonal()
    return rows


def _tuples(vectors: Floats) -> list[Vec3]:
    """Return vectors of shape (n, 3) as tuples of Python floats."""
    return list(zip(*vectors.T.tolist(), strict=True))
