"""The server's tick in the compiled room: forces in, limits on their change, patches out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic.control.stability.lag_choice import kept
from cohaptic_experiments.campaign.compiled import compiled, usable
from cohaptic_experiments.campaign.links import Queue, receive, send
from cohaptic_experiments.campaign.server_plan import REMEMBERED, Plan, anticipate
from cohaptic_server.numeric import Floats
from cohaptic_server.world.applied_forces import (
    EFFECT_RATE,
    allowed_fractions,
    fair_cap,
    limit_forces,
    low_pass,
)

for _function in (kept, low_pass, fair_cap, limit_forces, allowed_fractions):
    usable(_function)


class Server(NamedTuple):
    """The server's state of n users; each contact in its own frame, normal first.

    Fields:
        compliance: C of the contacts, shape (3 n, 3 n) [m/N].
        normal_compliance: Its rows and columns along the normals, shape (n, n) [m/N].
        stiffness: Gains K_h, shape (n,) [N/m].
        lags: The room's lag, once for each user, shape (n, 1) [s].
        heard: Force of each user's newest sample, shape (n, 3) [N].
        applied: Force on the body, after lag and limits, shape (n, 3) [N].
        plan: What it anticipates.
    """

    compliance: Floats
    normal_compliance: Floats
    stiffness: Floats
    lags: Floats
    heard: Floats
    applied: Floats
    plan: Plan


@compiled
def server_tick(
    server: Server, up: Queue, down: Queue, link: Floats, now: float, period: float
) -> None:
    """One simulation tick; changes `heard` and `applied`, and sends each user its patch.

    A patch is the displacement of the contact point by the others [m], the user's own force as the
    body has it [N], and the number of the tick.

    Args:
        server: Its state.
        up: Samples on their way, payloads of 4 numbers.
        down: Patches on their way, payloads of 7 numbers.
        link: As in `kernel.haptics`.
        now: [s].
        period: Simulation period N T [s].
    """
    n = len(link)
    for i in range(n):
        slot = receive(up, i, now)
        while slot >= 0:
            server.heard[i] = up.payload[i, slot, :3]
            server.plan.answered[i] = round(up.payload[i, slot, 3])
            slot = receive(up, i, now)
    previous, requested = np.copy(server.applied), np.copy(server.heard)
    # Bodies of the campaign are linear, and no force takes a hand through one.
    requested[:, 0] = limit_forces(np.copy(server.heard[:, 0]), np.full(n, np.inf))
    requested = anticipate(server.plan, requested)
    lagged = low_pass(previous, requested, server.lags, period)
    change = np.sqrt(((lagged - previous) ** 2).sum(axis=1))
    fractions = allowed_fractions(
        change, server.stiffness, server.normal_compliance, EFFECT_RATE * period
    )
    for i in range(n):
        server.applied[i] = previous[i] + fractions[i] * (lagged[i] - previous[i])
    server.plan.tick[0] += 1
    tick = server.plan.tick[0]
    server.plan.past[tick % REMEMBERED] = server.applied
    for i in range(n):
        due = now + link[i, 1] + link[i, 2] * np.random.random()  # noqa: NPY002
        if np.random.random() < link[i, 3]:  # noqa: NPY002
            continue
        patch = np.zeros(7)
        patch[6] = tick
        for a in range(3):
            moved = 0.0
            for j in range(n):
                if j != i:
                    for b in range(3):
                        moved -= server.compliance[3 * i + a, 3 * j + b] * server.applied[j, b]
            patch[a], patch[3 + a] = moved, server.applied[i, a]
        send(down, i, due, patch)
