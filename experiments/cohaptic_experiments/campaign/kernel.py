"""One trial of the campaign, compiled: the client's own functions at 1 kHz around a linear room.

The rest is a simplified shell, with each contact in its own frame (normal and two tangents): hands
on springs (`hand_motion.py`), one sample and one patch per simulation period over links with delay,
jitter and loss (`links.py`), the server's limits (`server_tick.py`), and the client's linear ramp
from patch to patch. `tests/experiments/campaign/test_hands.py` compares it with a session of the
real room and client.
"""

from __future__ import annotations

import numpy as np

from cohaptic import vec
from cohaptic.control import friction as coulomb
from cohaptic.control.friction import Compliance3, FrictionState, friction_step, normal_shift, times
from cohaptic.control.laws.model import Thresholds
from cohaptic.control.laws.pi import (
    IntegralState,
    integration_threshold,
    proportional_integral_step,
)
from cohaptic.control.laws.predictive import predictive_force
from cohaptic.control.laws.proportional import proportional_force
from cohaptic.vec import ZERO, add, dot, norm, scale, sub
from cohaptic_client.loop.arrival import next_patience
from cohaptic_client.loop.config import INTEGRAL_RELEASE_TIME
from cohaptic_client.loop.passivity import dissipate, given_energy, observe
from cohaptic_client.loop.rules.given import on_body
from cohaptic_client.loop.safety import (
    EXTERNAL_RATE,
    SAFETY_FADE_RATE,
    SafetyLimits,
    clamped,
    next_fraction,
    rate_of,
    towards,
)
from cohaptic_client.loop.slew import hold_back
from cohaptic_experiments.campaign.compiled import compiled, usable
from cohaptic_experiments.campaign.hand_motion import CLEARANCE, intended
from cohaptic_experiments.campaign.links import empty_queue, receive, send
from cohaptic_experiments.campaign.server_plan import empty_plan
from cohaptic_experiments.campaign.server_tick import Server, server_tick
from cohaptic_server.numeric import Floats

T = 1e-3  # s, haptic period
PROPORTIONAL, PI, PREDICTIVE = 0, 1, 2
TAIL = 4.0  # s at the end of a trial whose forces are kept
EVERY = 10  # periods between kept forces
FIGURES = 4  # per trial: see `haptics`

for _function in (
    vec.add, vec.sub, vec.scale, vec.dot, vec.cross, vec.norm, vec.unit,
    coulomb.times, coulomb.tangents, coulomb.normal_shift, coulomb.follow_material, friction_step,
    predictive_force, proportional_force, integration_threshold, proportional_integral_step,
    dissipate, given_energy, observe, next_fraction, clamped, towards, rate_of, hold_back,
    next_patience, on_body,
):  # fmt: skip
    usable(_function)
THRESHOLDS = Thresholds()
LIMITS = SafetyLimits()
SILENT_AFTER, FADE_TIME, ENGAGE_TIME = 0.1, LIMITS.fade_time, LIMITS.engage_time
MAX_FORCE = 100.0  # N; far above the devices' limits, so that growing forces are seen to grow


# One long function: its state is thirty arrays and scalars, which parts would have to pass on in
# every period; numba compiles it as one loop.
@compiled
def haptics(
    law: int,
    C: Floats,
    hand: Floats,
    device: Floats,
    motion: Floats,
    link: Floats,
    gains: Floats,
    lag: float,
    S: Floats,
    root: Floats,
    fraction: float,
    simulation_period: float,
    seed: int,
    seconds: float,
    tail: Floats,
    figures: Floats,
) -> None:
    """Run one trial.

    Args:
        law: Law of everybody: `PROPORTIONAL`, `PI` or `PREDICTIVE`.
        C: Compliance of the contacts, each in its own frame, shape (3 n, 3 n) [m/N].
        hand: Rows mass [kg], damping [N s/m], stiffness [N/m], depth [m], time of the press [s],
            shape (n, 5).
        device: Rows damping budget [N s/m], coefficient of friction, largest stiffness in any
            direction [N/m], shape (n, 3).
        motion: Rows amplitude [m], frequency [Hz] and phase [rad] of a tremor; amplitude [m] and
            frequency [Hz] of a slow motion, its amplitude sideways [m]; times of release, second
            press, and the end of all motion [s]. Shape (n, 9).
        link: Rows delay up, delay down, jitter [s], loss, shape (n, 4).
        gains: Rows K_h, I, shape (n, 2).
        lag: Lag of the room while all hands press [s]. It is kept throughout, although the server
            has a shorter one before they have touched and after they have let go.
        S: Coupling that is anticipated, shape (3 n, 3 n); empty for none.
        root: As in `server_plan.Plan`, shape (3 n,).
        fraction: As in `server_plan.Plan`.
        simulation_period: N T [s].
        seed: Seed of jitter, loss and phases.
        seconds: Length of haptics.
        tail: Forces on the hands at the end, written here, shape (k, n) [N].
        figures: Written here, shape (4,): sums over periods and users of the squared damping force
            and of the squared force [N^2]; the largest change of a force in a period that is not
            explained by the hand's own motion and the damping [N]; the share of periods in which a
            force was faded by the safety layer.
    """
    n = len(hand)
    np.random.seed(seed)  # noqa: NPY002 -- the generator that numba compiles, one per thread
    steps = round(seconds / T)
    first = steps - len(tail) * EVERY
    up, down = empty_queue(n, 4), empty_queue(n, 7)
    server = Server(
        C,
        np.ascontiguousarray(C[::3, ::3]),
        np.copy(gains[:, 0]),
        np.full((n, 1), lag),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        empty_plan(S, root, fraction, n),
    )
    answers = np.zeros(n)  # tick of the newest patch of each
    # The hands: normal and first tangent; along the second nobody moves.
    x, v = np.zeros((n, 2)), np.zeros((n, 2))
    x[:, 0] = CLEARANCE
    force = [ZERO for _ in range(n)]
    felt = [ZERO for _ in range(n)]  # without the damping
    integral, ramp, depth_before = np.zeros(n), np.zeros(n), np.zeros(n)
    sticks = [FrictionState(ZERO, ZERO, ZERO, False, 1.0, 0.0, False) for _ in range(n)]
    # The surface of the patch before, the newest, and when that came.
    x_from, x_to = np.zeros((n, 3)), np.zeros((n, 3))
    own_from, own_to = np.zeros((n, 3)), np.zeros((n, 3))
    arrived, patience = np.full(n, -1.0), np.zeros(n)
    pressed_on, shown_before = np.full(n, -1.0), np.zeros((n, 3))
    dent_before, own_before = np.zeros(n), np.zeros((n, 3))
    faded = np.ones(n)
    owed, damping, stored_before = np.zeros(n), np.zeros(n), np.zeros(n)
    next_send = np.random.random(n) * simulation_period  # noqa: NPY002
    next_tick = 0.0
    silent_after = max(SILENT_AFTER, 3.0 * simulation_period)
    budget = EXTERNAL_RATE * T
    normal: tuple[float, float, float] = (1.0, 0.0, 0.0)
    figures[:] = 0.0
    for k in range(steps):
        now = k * T
        if now >= next_tick:
            next_tick += simulation_period
            server_tick(server, up, down, link, now, simulation_period)
        for i in range(n):
            slot = receive(down, i, now)
            while slot >= 0:
                fraction = min(1.0, (now - arrived[i]) / simulation_period)
                x_from[i] += fraction * (x_to[i] - x_from[i])
                own_from[i] += fraction * (own_to[i] - own_from[i])
                x_to[i], own_to[i] = down.payload[i, slot, :3], down.payload[i, slot, 3:6]
                answers[i] = down.payload[i, slot, 6]
                if arrived[i] >= 0.0:
                    patience[i] = next_patience(patience[i], now - arrived[i])
                arrived[i] = now
                slot = receive(down, i, now)
            height, side = intended(hand[i], motion[i], now)
            mass, b, stiffness, mu = hand[i, 0], hand[i, 1], hand[i, 2], device[i, 1]
            x0, x1 = x[i, 0], x[i, 1]
            v[i, 0] = (v[i, 0] + T * (stiffness * (height - x0) + force[i][0]) / mass) / (
                1.0 + b * T / mass
            )
            x[i, 0] += T * v[i, 0]
            if mu > 0.0:
                v[i, 1] = (v[i, 1] + T * (stiffness * (side - x1) + force[i][1]) / mass) / (
                    1.0 + b * T / mass
                )
                x[i, 1] += T * v[i, 1]
            way = (x[i, 0] - x0, x[i, 1] - x1, 0.0)
            fraction = min(1.0, (now - arrived[i]) / simulation_period)
            shown = (
                x_from[i, 0] + fraction * (x_to[i, 0] - x_from[i, 0]),
                x_from[i, 1] + fraction * (x_to[i, 1] - x_from[i, 1]),
                x_from[i, 2] + fraction * (x_to[i, 2] - x_from[i, 2]),
            )
            own = (
                own_from[i, 0] + fraction * (own_to[i, 0] - own_from[i, 0]),
                own_from[i, 1] + fraction * (own_to[i, 1] - own_from[i, 1]),
                own_from[i, 2] + fraction * (own_to[i, 2] - own_from[i, 2]),
            )
            k_h, c_ii = gains[i, 0], C[3 * i, 3 * i]
            own_way, own_budget = -way[0], budget
            if faded[i] < 1.0:
                own_budget -= SAFETY_FADE_RATE * T
            if mu > 0.0:
                own_budget *= 0.5
            depth = shown[0] - x[i, 0]
            if faded[i] > 0.0:
                depth = hold_back(pressed_on[i] + own_way, depth, own_budget / k_h)
            pressed_on[i] = depth
            block = Compliance3(
                c_ii, C[3 * i + 1, 3 * i + 1], C[3 * i + 2, 3 * i + 2],
                C[3 * i, 3 * i + 1], C[3 * i, 3 * i + 2], C[3 * i + 1, 3 * i + 2],
            )  # fmt: skip
            if mu > 0.0:
                depth -= normal_shift(sticks[i], normal, block)
            dent = 0.0 if law == PREDICTIVE else c_ii * own[0]
            if law == PREDICTIVE:
                f = predictive_force(depth, k_h)
                stored = 0.5 * f * max(0.0, depth)
            else:
                if law == PI:
                    state, f = proportional_integral_step(
                        IntegralState(integral[i], ramp[i], depth_before[i]),
                        depth - dent,
                        k_h,
                        gains[i, 1],
                        THRESHOLDS,
                        max(INTEGRAL_RELEASE_TIME, 2.0 * simulation_period),
                        MAX_FORCE,
                        T,
                        own_way,
                        own_budget,
                    )
                    integral[i], ramp[i], depth_before[i] = state.force, state.ramp, state.depth
                else:
                    f = proportional_force(depth - dent, k_h)
                stored = 0.5 * k_h * max(0.0, depth - dent) ** 2
            damped = f
            if device[i, 0] > 0.0:
                damping[i], damped = dissipate(owed[i], damping[i], f, -v[i, 0], T, device[i, 0])
            along = ZERO
            if mu > 0.0:
                part = min(1.0, k_h * c_ii)
                sticks[i] = friction_step(
                    sticks[i],
                    way,
                    shown,
                    normal,
                    f,
                    block,
                    mu,
                    part,
                    device[i, 2],
                    0.5 * own_budget,
                )
                along = sticks[i].force
                both = add(scale(normal, f), add(scale(normal, f), along))
                stored += 0.5 * dot(along, times(block, both)) / sticks[i].fraction
            law_force = add(scale(normal, damped), along)
            # A hand is engaged in full when a trial begins, before its first patch.
            quiet = now - arrived[i] > max(silent_after, patience[i]) and arrived[i] >= 0.0
            size = norm(law_force)
            faded[i] = next_fraction(
                faded[i], not quiet, size, FADE_TIME if quiet else ENGAGE_TIME, T
            )
            rate = rate_of(device[i, 2])
            given = towards(force[i], scale(clamped(law_force, MAX_FORCE), faded[i]), rate * T)
            ratio = norm(given) / size if size > 0.0 else faded[i]
            contact = on_body(add(scale(normal, f), along), ratio, MAX_FORCE)
            if device[i, 0] > 0.0:
                held = given_energy(stored, ratio, faded[i])
                risen = (shown[0] - dent) - (shown_before[i, 0] - dent_before[i])
                from_body = 0.5 * (own[0] + own_before[i, 0]) * risen
                if mu > 0.0:
                    for a in range(1, 3):
                        from_body += (
                            0.5 * (own[a] + own_before[i, a]) * (shown[a] - shown_before[i, a])
                        )
                work = 0.5 * dot(add(force[i], given), way)
                owed[i] = observe(owed[i], work, held - stored_before[i], from_body, T)
                stored_before[i] = held
            for a in range(3):
                shown_before[i, a] = shown[a]
                own_before[i, a] = own[a]
            dent_before[i] = dent
            # Change that neither the hand's own motion nor the damping explains.
            step = sub(contact, felt[i])
            if mu > 0.0:
                # Friction is a share mu of a normal force that the motion changes.
                left = norm(step) - (1.0 + mu) * device[i, 2] * norm(way)
            else:
                expected = k_h * own_way
                left = max(step[0] - max(0.0, expected), min(0.0, expected) - step[0])
            if now > 0.1:
                figures[2] = max(figures[2], left)
            if faded[i] < 1.0:
                figures[3] += 1.0 / (n * steps)
            force[i], felt[i] = given, contact
            figures[0] += (ratio * (damped - f)) ** 2
            figures[1] += f * f
            if k >= first and (k - first) % EVERY == 0:
                tail[(k - first) // EVERY, i] = given[0]
            if now >= next_send[i]:
                next_send[i] += simulation_period
                due = now + link[i, 0] + link[i, 2] * np.random.random()  # noqa: NPY002
                if np.random.random() >= link[i, 3]:  # noqa: NPY002
                    sample = (contact[0], contact[1], contact[2], answers[i])
                    send(up, i, due, sample)
