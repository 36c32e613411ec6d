"""Trials of the campaign side by side on all cores."""

from __future__ import annotations

from cohaptic_experiments.campaign.compiled import compiled_in_parallel, on_all_cores
from cohaptic_experiments.campaign.kernel import haptics
from cohaptic_server.numeric import Floats, Ints


@compiled_in_parallel
def all_haptics(
    law: int,
    users: Ints,
    C: Floats,
    hands: Floats,
    devices: Floats,
    motions: Floats,
    links: Floats,
    gains: Floats,
    lags: Floats,
    couplings: Floats,
    roots: Floats,
    fractions: Floats,
    periods: Floats,
    seeds: Ints,
    seconds: float,
    tails: Floats,
    figures: Floats,
) -> None:
    """Run `haptics` for many trials in parallel; arrays have one more leading dimension.

    Args:
        law: As in `haptics`, like every other argument that is not named here.
        users: Number of hands of each trial, shape (trials,).
        C: Padded with zeros to the largest room.
        hands: Padded likewise.
        devices: Padded likewise.
        motions: Padded likewise.
        links: Padded likewise.
        gains: Padded likewise.
        lags: Lags of the rooms, shape (trials,) [s].
        couplings: S of each, padded likewise.
        roots: Padded likewise.
        fractions: Share of the negative part that is anticipated, (trials,); below 0 for nothing.
        periods: Simulation periods, shape (trials,) [s].
        seeds: Shape (trials,).
        seconds: Length of the haptics [s].
        tails: Written here, shape (trials, k, n) [N].
        figures: Written here, shape (trials, 4).
    """
    for t in on_all_cores(len(users)):
        n = users[t]
        haptics(
            law,
            C[t, : 3 * n, : 3 * n],
            hands[t, :n],
            devices[t, :n],
            motions[t, :n],
            links[t, :n],
            gains[t, :n],
            lags[t],
            couplings[t, : 3 * n if fractions[t] >= 0.0 else 0, : 3 * n],
            roots[t, : 3 * n],
            fractions[t],
            periods[t],
            seeds[t],
            seconds,
            tails[t, :, :n],
            figures[t],
        )
