"""The loop between hands that are modelled: its gain, and a model and a lag that keep it below 1.

Hand j is Z_j = m s^2 + b s + k and is taken for Z'_j. It is d_j = E_j f_j away from where its model
says, with E = 1 / Z - 1 / Z'. With A = (C + 1 / Z')^-1 over all contacts, the loop between hands is

    q_j = ... + sum_k T_jk D_jk q_k,    T_jk = -E_j A_jk / (1 + E_j A_jj)   (k != j),   T_jj = 0.

Whatever the delays D, it is stable where the spectral radius of |T| is below 1 at every frequency.
Arrays of hands have the last axis (m [kg], b [N s/m], k [N/m]).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.numeric import Complex, Floats, Mask

# Hz; narrower than the peaks of hands with b / m = 2 / s, which are 0.3 Hz wide. Above, the gain
# falls with 1 / f^2.
FREQUENCIES = np.concatenate([np.geomspace(0.1, 1.0, 12)[:-1], np.geomspace(1.0, 60.0, 150)])
# s; lags of q from which one is chosen. The longest is as slow as the lag of a room of the product.
LAGS = np.array([0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32])
# 1/s, of the logarithms of a model. While it moves, the copies of it in other clients are late by
# a tick or so, which shakes forces by 10 mN at the higher rate. That is for a hand whose lag has to
# grow: its loop may be swinging up.
RATE, RATE_IN_NEED = 0.15, 0.5
# Change of a lag in a second: q catches up with a hand as if that were faster by so much. A lag
# that jumps would move q by the lag times the hand's speed (science 3.15). Reasoned, not measured.
LAG_DOWN, LAG_UP = 0.02, 0.1
# With these two none of 720 rooms swung (`python -m cohaptic_experiments.partner_models.ensemble`).
SURE = 0.98  # of the hands that a hand may be
GAIN = 0.9  # largest sum of a row of |T|; the rest is for sampling and frequencies between


def impedance(hands: Floats, frequencies: Floats) -> Complex:
    """Return Z of hands (..., 3) at f frequencies [Hz], k - m w^2 + i b w, (..., f) [N/m]."""
    m, b, k = (hands[..., i, None] for i in range(3))
    w = 2.0 * np.pi * frequencies
    return np.asarray(k - m * w**2 + 1j * b * w)  # (3.15) Z = m s^2 + b s + k at s = i w


def contacts(C: Floats, models: Floats, frequencies: Floats) -> Complex:
    """Return A = (C + 1 / Z')^-1.

    Args:
        C: Compliance between n contacts, shape (..., n, n) [m/N].
        models: Model of each hand, shape (..., n, 3).
        frequencies: Frequencies, shape (f,) [Hz].

    Returns:
        Shape (..., f, n, n) [N/m].
    """
    compliance = np.moveaxis(1.0 / impedance(models, frequencies), -1, -2)
    n = C.shape[-1]
    # (3.15) A = (C + Z'^-1)^-1, with Z' = the models
    A = np.linalg.inv(C[..., None, :, :] + compliance[..., None] * np.eye(n))
    return np.asarray(A, dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What a hand meets at its contact, with the models of all others in place.

    Args:
        compliance: Displacement of the contact by a force on it, shape (..., f) [m/N].
        fraction: Sum over the others of |A_jk / A_jj|: what they do to the contact, shape (..., f).
    """

    compliance: Complex
    fraction: Floats


def surroundings(C: Floats, models: Floats, frequencies: Floats) -> Surroundings:
    """Return what each of n hands meets, shapes (..., n, f); arguments as for `contacts`."""
    A = contacts(C, models, frequencies)
    own = np.moveaxis(np.diagonal(A, axis1=-2, axis2=-1), -1, -2)
    # (3.15) 1 / A_jj = 1 / Z'_j + c_j, with c_j = compliance
    compliance = 1.0 / own - 1.0 / impedance(models, frequencies)
    # (3.15) sum over k != j of |A_jk / A_jj|
    others = np.moveaxis(np.abs(A).sum(axis=-1), -1, -2) - np.abs(own)
    return Surroundings(np.asarray(compliance), np.asarray(others / np.abs(own)))


def row(around: Surroundings, hands: Floats, model: Floats, frequencies: Floats) -> Floats:
    """Return the sum of a row of |T| for hands that are taken for a model.

    Args:
        around: Surroundings of one hand, shapes that broadcast with (..., f).
        hands: The hand may be any of these, shape (..., 3).
        model: Model, shape that broadcasts with (..., 3).
        frequencies: Frequencies, shape (f,) [Hz].

    Returns:
        Shape (..., f).
    """
    y, taken = 1.0 / impedance(hands, frequencies), 1.0 / impedance(model, frequencies)
    # (3.15) sum_k |T_jk|, T_jk = -(1 / Z_j - 1 / Z'_j) / (1 / Z_j + c_j) A_jk / A_jj
    return np.asarray(np.abs((y - taken) / (y + around.compliance)) * around.fraction)


def lag(around: Surroundings, clouds: Floats, models: Floats) -> Floats:
    """Return the least of `LAGS` that keeps a hand's row below `GAIN`, for h hands.

    The spectral radius of a matrix without negative entries is at most its largest row sum, so that
    each hand can see to its own row: the lag of its q divides it by |1 + i w lag|.

    Args:
        around: Surroundings of each hand at `FREQUENCIES`, shapes (h, f).
        clouds: Hands that each may be, equally likely, shape (h, p, 3).
        models: Model of each, shape (h, 3).

    Returns:
        Lag of each that suffices for `SURE` of its cloud, or the longest, shape (h,) [s].
    """
    each = Surroundings(around.compliance[:, None], around.fraction[:, None])
    gain = row(each, clouds, models[:, None], FREQUENCIES)
    # (3.15 c) g_j(w) = sum_k |T_jk| < (1 + w^2 tau_j^2)^(1/2), with `GAIN` in place of 1
    lagged = 1.0 / np.sqrt(1.0 + (2.0 * np.pi * FREQUENCIES * LAGS[:, None]) ** 2)
    worst = np.stack([(gain * L).max(axis=-1) for L in lagged], axis=-1)
    enough = np.quantile(worst, SURE, axis=1) < GAIN
    return np.asarray(LAGS[np.where(enough.any(axis=-1), enough.argmax(axis=-1), len(LAGS) - 1)])


def towards(models: Floats, wanted: Floats, in_need: Mask, dt: float) -> Floats:
    """Return models on their way to others.

    Args:
        models: Models, shape (..., 3).
        wanted: The others, of the same shape.
        in_need: Whether the lag of each hand has to grow, shape (...).
        dt: Time [s].
    """
    limit = np.where(in_need, RATE_IN_NEED, RATE)[..., None] * dt
    return np.asarray(models * np.exp(np.clip(np.log(wanted / models), -limit, limit)))


def lag_towards(lags: Floats, wanted: Floats, dt: float) -> Floats:
    """Return lags on their way to others after a time [s]."""
    return np.asarray(lags + np.clip(wanted - lags, -LAG_DOWN * dt, LAG_UP * dt))
