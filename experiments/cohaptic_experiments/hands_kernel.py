"""Haptics of a room of hands, compiled: the client's law and passivity functions at 1 kHz.

Everything else is the shell that those functions live in, one-dimensional and linear: hands on
springs, samples and patches once per simulation period, links with delay, jitter and order, the
straight line from patch to patch. `tests/experiments/test_hands.py` lays it beside a session of the
real room and client.
"""

from __future__ import annotations

import numpy as np

from cohaptic.control.predictive import predictive_step
from cohaptic.control.proportional import proportional_force
from cohaptic.control.proportional_integral import (
    IntegralState,
    Thresholds,
    integration_threshold,
    proportional_integral_step,
)
from cohaptic_client.loop_config import RELEASE_TIME
from cohaptic_client.passivity import dissipate, observe
from cohaptic_experiments.compiled import compiled, compiled_in_parallel, on_all_cores, usable
from cohaptic_server.bodies.mesh import Floats, Ints

T = 1e-3  # s
PRESS_TIME = 0.3  # s
CLEARANCE = 0.01  # m in front of the surface before the press
PROPORTIONAL, PI, PREDICTIVE = 0, 1, 2
TAIL = 4.0  # s at the end of a trial that are kept
EVERY = 10  # periods between kept forces
MAX_FORCE = 100.0  # N; no safety layer here: what grows shall be seen to grow
SLOTS = 128  # messages in flight; 0.31 s at 100 Hz are 31

for _function in (
    predictive_step,
    proportional_force,
    integration_threshold,
    proportional_integral_step,
    dissipate,
    observe,
):
    usable(_function)
THRESHOLDS = Thresholds()


@compiled
def haptics(
    law: int,
    max_damping: float,
    C: Floats,
    hand: Floats,
    link: Floats,
    gains: Floats,
    simulation_period: float,
    seed: int,
    seconds: float,
    tail: Floats,
) -> tuple[float, float]:
    """One trial.

    Args:
        law: Of everybody.
        max_damping: Of the passivity layer; 0 switches it off [N s/m].
        C: Shape (n, n) [m/N].
        hand: Rows mass, damping, stiffness, depth, time of the press, shape (n, 5).
        link: Rows delay up, delay down, jitter, shape (n, 3) [s].
        gains: Rows K_h, I, shape (n, 2).
        simulation_period: N T [s].
        seed: Of jitter and phases.
        seconds: Of haptics.
        tail: Forces on the hands at the end, written here, shape (k, n) [N].

    Returns:
        Sums over periods and users of the squared damping force and of the squared force [N^2].
    """
    n = len(hand)
    np.random.seed(seed)  # noqa: NPY002 -- the generator that numba compiles, one per thread
    steps = round(seconds / T)
    first = steps - len(tail) * EVERY
    # Links: due time and payload of what is on its way.
    up_due, up_force = np.zeros((n, SLOTS)), np.zeros((n, SLOTS))
    down_due, down_x, down_own = (
        np.zeros((n, SLOTS)),
        np.zeros((n, SLOTS)),
        np.zeros((n, SLOTS)),
    )
    up_in, up_out = np.zeros(n, np.int64), np.zeros(n, np.int64)
    down_in, down_out = np.zeros(n, np.int64), np.zeros(n, np.int64)
    up_last, down_last = np.zeros(n), np.zeros(n)
    on_body = np.zeros(n)
    x, v, force = np.full(n, -CLEARANCE), np.zeros(n), np.zeros(n)
    integral, ramp, depth_before = np.zeros(n), np.zeros(n), np.zeros(n)
    # The surface of the patch before, the newest, and when that came.
    x_from, x_to, own_from, own_to = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    arrived, x_shown = np.full(n, -1e9), np.zeros(n)
    owed, damping = np.zeros(n), np.zeros(n)
    next_send = np.random.random(n) * simulation_period  # noqa: NPY002
    next_tick = 0.0
    damping_sum = force_sum = 0.0
    for k in range(steps):
        now = k * T
        if now >= next_tick:
            next_tick += simulation_period
            for i in range(n):
                while up_out[i] < up_in[i] and up_due[i, up_out[i] % SLOTS] <= now:
                    on_body[i] = up_force[i, up_out[i] % SLOTS]
                    up_out[i] += 1
            for i in range(n):
                x_free = 0.0
                for j in range(n):
                    if j != i:
                        x_free += C[i, j] * on_body[j]
                slot = down_in[i] % SLOTS
                late = now + link[i, 1] + link[i, 2] * np.random.random()  # noqa: NPY002
                down_last[i] = max(down_last[i], late)
                down_due[i, slot] = down_last[i]
                down_x[i, slot], down_own[i, slot] = x_free, on_body[i]
                down_in[i] += 1
        for i in range(n):
            while down_out[i] < down_in[i] and down_due[i, down_out[i] % SLOTS] <= now:
                slot = down_out[i] % SLOTS
                share = min(1.0, (now - arrived[i]) / simulation_period)
                x_from[i] += share * (x_to[i] - x_from[i])
                own_from[i] += share * (own_to[i] - own_from[i])
                x_to[i], own_to[i], arrived[i] = down_x[i, slot], down_own[i, slot], now
                down_out[i] += 1
            mass, b, stiffness = hand[i, 0], hand[i, 1], hand[i, 2]
            s = min(1.0, max(0.0, (now - hand[i, 4]) / PRESS_TIME))
            target = -CLEARANCE + (hand[i, 3] + CLEARANCE) * s * s * (3.0 - 2.0 * s)
            pull = stiffness * (target - x[i]) - force[i]
            v[i] = (v[i] + T * pull / mass) / (1.0 + b * T / mass)
            x[i] += T * v[i]
            share = min(1.0, (now - arrived[i]) / simulation_period)
            surface = x_from[i] + share * (x_to[i] - x_from[i])
            own = own_from[i] + share * (own_to[i] - own_from[i])
            depth = x[i] - surface
            if law == PREDICTIVE:
                integral[i], f = predictive_step(
                    integral[i], depth, gains[i, 0], gains[i, 1], C[i, i], T
                )
            elif law == PI:
                state, f = proportional_integral_step(
                    IntegralState(integral[i], ramp[i], depth_before[i]),
                    depth - C[i, i] * own,
                    gains[i, 0],
                    gains[i, 1],
                    THRESHOLDS,
                    max(RELEASE_TIME, 2.0 * simulation_period),
                    MAX_FORCE,
                    T,
                )
                integral[i], ramp[i], depth_before[i] = state.force, state.ramp, state.depth
            else:
                f = proportional_force(depth - C[i, i] * own, gains[i, 0])
            f = min(f, MAX_FORCE)
            force[i] = f
            if max_damping > 0.0:
                # Into the body is the positive way here, towards the hand the negative.
                pressed = surface if law == PREDICTIVE else surface + C[i, i] * own
                owed[i] = observe(owed[i], f, own, x_shown[i] - pressed, T)
                owed[i], damping[i], force[i] = dissipate(
                    owed[i], damping[i], f, v[i], T, max_damping
                )
                x_shown[i] = pressed
            damping_sum += (force[i] - f) ** 2
            force_sum += f * f
            if k >= first and (k - first) % EVERY == 0:
                tail[(k - first) // EVERY, i] = force[i]
            if now >= next_send[i]:
                next_send[i] += simulation_period
                slot = up_in[i] % SLOTS
                late = now + link[i, 0] + link[i, 2] * np.random.random()  # noqa: NPY002
                up_last[i] = max(up_last[i], late)
                up_due[i, slot], up_force[i, slot] = up_last[i], f
                up_in[i] += 1
    return damping_sum, force_sum


@compiled_in_parallel
def all_haptics(
    law: int,
    max_damping: float,
    users: Ints,
    C: Floats,
    hands: Floats,
    links: Floats,
    gains: Floats,
    periods: Floats,
    seeds: Ints,
    seconds: float,
    tails: Floats,
    damping: Floats,
) -> None:
    """`haptics` of many trials side by side; arrays have one more dimension in front.

    Args:
        law: As in `haptics`, like every other argument that is not named here.
        max_damping: Same.
        users: Number of hands of each trial, shape (trials,).
        C: Padded to the largest room.
        hands: Same.
        links: Same.
        gains: Same.
        periods: Simulation periods, shape (trials,) [s].
        seeds: Shape (trials,).
        seconds: Of haptics.
        tails: Written here, shape (trials, k, n) [N].
        damping: The two sums, written here, shape (trials, 2) [N^2].
    """
    for t in on_all_cores(len(users)):
        n = users[t]
        damping[t, 0], damping[t, 1] = haptics(
            law,
            max_damping,
            C[t, :n, :n],
            hands[t, :n],
            links[t, :n],
            gains[t, :n],
            periods[t],
            seeds[t],
            seconds,
            tails[t, :, :n],
        )
