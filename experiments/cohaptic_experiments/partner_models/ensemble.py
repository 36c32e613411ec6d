"""Ensembles of random linear rooms: how many swing up, and what is felt, with estimated models.

Run `python -m cohaptic_experiments.partner_models.ensemble` for the table; see `--help`.
"""

from __future__ import annotations

import argparse
from dataclasses import astuple, dataclass, replace

import numpy as np
import numpy.typing as npt

from cohaptic.simulated.hand import Hand
from cohaptic_experiments.partner_models.linear_room import Played, Rooms, Way, play, truth
from cohaptic_experiments.partner_models.loop_gain import loops, radius
from cohaptic_experiments.transparency.frequency import HALF_POWER, falls_below
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.numeric import Complex, Floats
from cohaptic_server.world.partners.small_gain import FREQUENCIES, contacts, impedance

USUAL = np.array(astuple(Hand()))  # the hand that everybody is taken for at first
OWN = 1.0 / 325.0  # m/N; compliance of a balloon under a finger
# Of it between two contacts; more hands share what the air inside can carry.
BETWEEN = {2: -0.55, 3: -0.41, 4: -0.28}
KINDS = ("rest", "sway", "one taps", "all tap", "in step", "tense")
_TREMOR = ((20e-6, 3.0, 8.0), (20e-6, 3.0, 8.0), (30e-6, 8.0, 10.0), (30e-6, 8.0, 10.0))
_DRIFT = ((0.3e-3, 0.05, 0.3), (0.3e-3, 0.05, 0.3))  # m, Hz, Hz
_SWAY = ((3e-3, 0.3, 1.0), (1e-3, 1.0, 3.0))
_TAP = 8e-3  # m
PRESS = 4e-3  # m
_HIGHEST = 20.0  # Hz, up to which the first frequency at -3 dB is sought


def compliance(rooms: int, n: int) -> Floats:
    """Return C of rooms with n hands, shape (rooms, n, n) [m/N]."""
    return np.tile(OWN * (np.eye(n) * (1.0 - BETWEEN[n]) + BETWEEN[n]), (rooms, 1, 1))


def draw(rng: np.random.Generator, rooms: int, n: int, least_damping: float = 1.0) -> Floats:
    """Draw hands of 0.05 to 0.5 kg, up to 10 N s/m and 100 to 1000 N/m, shape (rooms, n, 3)."""
    shape = (rooms, n)
    return np.stack(
        [
            rng.uniform(0.05, 0.5, shape),
            rng.uniform(least_damping, 10.0, shape),
            10.0 ** rng.uniform(2.0, 3.0, shape),
        ],
        axis=-1,
    )


def intentions(rng: np.random.Generator, kind: str, seconds: float, rooms: int, n: int) -> Floats:
    """Return what hands want, (t, rooms, n) [m]. All tremble and drift; one presses at 2 s."""
    t = PERIOD * np.arange(round(seconds / PERIOD))[:, None, None]
    first = np.arange(n) == 0
    wanted = PRESS * np.clip((t - 2.0) / 0.02, 0.0, 1.0) * first
    for amplitude, low, high in (*_TREMOR, *_DRIFT, *(_SWAY if kind == "sway" else ())):
        f, phase = rng.uniform(low, high, (rooms, n)), rng.uniform(0.0, 2.0 * np.pi, (rooms, n))
        wanted = wanted + amplitude * np.sin(2.0 * np.pi * f * t + phase)
    if kind in ("one taps", "all tap", "in step"):
        f, phase = rng.uniform(2.0, 5.0, (rooms, n)), rng.random((rooms, n))
        if kind == "in step":
            f, phase = f[:, :1], np.zeros((rooms, 1))
        u = (f * t + phase) % 1.0
        level = np.where(u < 0.5, _ease(u / 0.2), 1.0 - _ease((u - 0.5) / 0.2))
        wanted = wanted + _TAP * level * (t > 1.0) * (first if kind == "one taps" else 1.0)
    return np.asarray(wanted)


def _ease(s: Floats) -> Floats:
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s * s * (3.0 - 2.0 * s))


def felt(C: Floats, hands: Floats, models: Floats, lags: Floats, delays: Floats) -> Complex:
    """Return what each hand feels of the first one's intention, over the truth, at `FREQUENCIES`.

    Args:
        C: Compliance, shape (R, n, n) [m/N].
        hands: Shape (R, n, 3).
        models: Shape (R, n, 3).
        lags: Lag of q of each, shape (R, n) [s].
        delays: Of each hand, each way, shape (R, n) [s].

    Returns:
        Shape (R, f, n).
    """
    n, s = C.shape[-1], 2j * np.pi * FREQUENCIES[:, None, None]
    A = contacts(C, models, FREQUENCIES)
    free, taken = (np.moveaxis(1.0 / impedance(h, FREQUENCIES), -1, -2) for h in (hands, models))
    own = np.diagonal(A, axis1=-2, axis2=-1)
    # From the q of j as hand k has it: late and lagged, but for its own.
    late = np.exp(-s * (delays[:, None, :, None] + delays[:, None, None, :]))
    late = late / (1.0 + s * lags[:, None, None, :])
    late = np.where(np.eye(n, dtype=bool), 1.0, late)
    T = loops(C, hands, models, FREQUENCIES) * late
    moved = np.eye(n)[0] / (1.0 + (free - taken) * own)
    q = np.linalg.solve(np.eye(n) - T, moved[..., None])
    true = contacts(C, hands, FREQUENCIES)[..., 0]
    return np.asarray(((A * late) @ q)[..., 0] / true)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Outcome of R rooms.

    Args:
        swung: Whether a force swings more in the end than it should, shape (R,).
        grew: Whether that still grows, shape (R,).
        radius: Largest spectral radius of the loop over frequency with the last models, shape (R,).
        error: Logarithm of model over hand in the end, shape (R, n, 3).
        lags: In the end, shape (R, n) [s].
        played: All of it.
    """

    swung: npt.NDArray[np.bool_]
    grew: npt.NDArray[np.bool_]
    radius: Floats
    error: Floats
    lags: Floats
    played: Played


def outcome(rooms: Rooms, way: Way, known: Floats, true: Floats) -> Outcome:
    """Play rooms and judge them.

    A force swings if, in the last 2 s, it spans more than twice what it does with right models or
    without a network, and 0.3 N.

    Args:
        rooms: Rooms.
        way: How hands are modelled.
        known: Forces with right models, shape (t, R, n) [N].
        true: Forces without a network, shape (t, R, n) [N].
    """
    played = play(rooms, way)
    last, before = (
        slice(-round(2.0 / PERIOD), None),
        slice(-round(5.0 / PERIOD), -round(3.0 / PERIOD)),
    )
    span, earlier = np.ptp(played.force[last], axis=0), np.ptp(played.force[before], axis=0)
    right = np.maximum(np.ptp(known[last], axis=0), np.ptp(true[last], axis=0))
    much = ~(span < 2.0 * right + 0.3)
    models = played.models[-1] if played.models else np.broadcast_to(way.models, rooms.hands.shape)
    lags = played.lags[-1] if played.lags else np.full(models.shape[:2], way.lag)
    T = loops(rooms.C, rooms.hands, models, FREQUENCIES)
    T = T / (1.0 + 2j * np.pi * FREQUENCIES[:, None, None] * lags[:, None, None, :])
    return Outcome(
        much.any(axis=1), (much & ~(span < 1.05 * earlier)).any(axis=1),
        radius(T).max(axis=1), np.log(models / rooms.hands), lags, played,
    )  # fmt: skip


def make(
    rng: np.random.Generator, kind: str, R: int, n: int, delay: float, seconds: float,
    least_damping: float = 1.0,
) -> Rooms:  # fmt: skip
    """Draw rooms of a kind; all links have the delay [s], and 20 ms of jitter if it is not 0."""
    hands = draw(rng, R, n, least_damping)
    wanted = intentions(rng, kind, seconds, R, n)
    rooms = Rooms(hands, compliance(R, n), wanted, np.full((R, n), delay), 0.02 if delay else 0.0)
    if kind == "tense":
        later = hands * np.where(np.arange(n)[:, None] == 0, (1.0, 1.5, 3.0), 1.0)
        rooms = replace(rooms, hands=later, hands_before=hands, tense_at=0.5 * seconds)
    return rooms


WAYS = {
    "usual": Way(USUAL),
    "usual, 40 ms": Way(USUAL, lag=0.04),
    "mean": Way(USUAL, estimates=True),
    "mean, lag": Way(USUAL, lag=0.04, estimates=True, lags=True),
}


def run(
    kinds: tuple[str, ...], sizes: tuple[int, ...], delays: tuple[float, ...], R: int,
    seconds: float, ways: dict[str, Way], seed: int = 0, least_damping: float = 1.0,
) -> None:  # fmt: skip
    """Print a line for each combination."""
    print("kind n delay way: rooms that swing, still growing; share of radius < 1, swung of them;"
          " |log error| m b k median, 90 %; lag median, 90 % [ms];"
          " -3 dB median, least tenth [Hz]; largest response median, 90 %")  # fmt: skip
    for kind in kinds:
        for n in sizes:
            for delay in delays:
                rng = np.random.default_rng(seed)
                rooms = make(rng, kind, R, n, delay, seconds, least_damping)
                known, true = play(rooms, Way(rooms.hands)).force, truth(rooms)
                for name, way in ways.items():
                    found = outcome(rooms, replace(way, seed=seed), known, true)
                    print(
                        f"{kind:9s}{n} {1e3 * delay:3.0f} {name:12s}",
                        _line(rooms, found),
                        flush=True,
                    )


def _line(rooms: Rooms, found: Outcome) -> str:
    small = found.radius < 1.0
    error = np.abs(found.error).reshape(-1, 3)
    models = rooms.hands * np.exp(found.error)
    other = np.abs(felt(rooms.C, rooms.hands, models, found.lags, rooms.delay))[..., 1:]
    weakest, strongest = other.min(axis=-1), other.max(axis=(1, 2))
    below = np.array([min(_HIGHEST, falls_below(FREQUENCIES, row, HALF_POWER)) for row in weakest])
    lag = 1e3 * found.lags
    return (
        f"{int(found.swung.sum()):3d} {int(found.grew.sum()):3d} /{len(small)};"
        f" {small.mean():.2f} {int((found.swung & small).sum())};"
        f" {np.median(error, axis=0).round(2)} {np.quantile(error, 0.9, axis=0).round(2)};"
        f" {np.median(lag):.0f} {np.quantile(lag, 0.9):.0f};"
        f" {np.median(below):.1f} {np.quantile(below, 0.1):.1f};"
        f" {np.median(strongest):.2f} {np.quantile(strongest, 0.9):.2f}"
    )


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kinds", nargs="*", choices=KINDS, default=list(KINDS))
    parser.add_argument("--users", nargs="*", type=int, choices=tuple(BETWEEN), default=[2])
    parser.add_argument("--delays-ms", nargs="*", type=float, default=[0.0, 80.0, 250.0])
    parser.add_argument("--rooms", type=int, default=40)
    parser.add_argument("--seconds", type=float, default=16.0)
    parser.add_argument("--least-damping", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--ways", nargs="*", choices=tuple(WAYS), default=list(WAYS))
    a = parser.parse_args()
    run(
        tuple(a.kinds), tuple(a.users), tuple(1e-3 * d for d in a.delays_ms), a.rooms, a.seconds,
        {name: WAYS[name] for name in a.ways}, a.seed, a.least_damping,
    )  # fmt: skip


if __name__ == "__main__":
    _main()
