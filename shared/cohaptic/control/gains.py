"""The one place that decides a gain.

Every rule here is a row bound, so a client's gain needs nothing but its own row of |C|:

    proportional   K_h,i < 1 / sum_j |C_ij|                  any bounded delay (3.2; Chazan and
                                                             Miranker 1969), and (8) when alone
    predictive     K_i <= min(1 / C_ii, alpha / sum_{j!=i} |C_ij|)                          (3.3)

and below what the device renders stably (Colgate's limit, as the device states it).
"""

from __future__ import annotations

from collections.abc import Sequence

from cohaptic.control.law import Law

# Distance kept from the edge of stability. At 0.95 a proportional loop forgets 5 % a round trip.
ALPHA = 0.95


def coupled_stiffness(row: Sequence[float]) -> float:
    """Coupling-aware stiffness 1 / sum_j |C_ij| of one contact (science 3.2) [N/m].

    Args:
        row: Row i of the contact compliance C, own entry included [m/N].
    """
    return 1.0 / sum(abs(c) for c in row)


def choose_gain(
    law: Law, row: Sequence[float], i: int, *, max_stiffness: float, alpha: float = ALPHA
) -> float:
    """Gain of client i for its law.

    Args:
        law: Local model of the client.
        row: Row i of the contact compliance C of all present contacts [m/N].
        i: Index of the client's own contact in `row`.
        max_stiffness: Largest gain that its device renders stably [N/m].
        alpha: Margin, < 1.

    Returns:
        Gain K_h [N/m].
    """
    if law is Law.PROPORTIONAL:
        bound = alpha * coupled_stiffness(row)
    else:
        others = sum(abs(c) for j, c in enumerate(row) if j != i)
        bound = 1.0 / row[i]
        if others > 0.0:
            bound = min(bound, alpha / others)
    return min(bound, max_stiffness)
