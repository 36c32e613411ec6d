"""Random contact compliances for tests."""

from __future__ import annotations

import numpy as np


def random_compliance(n: int, seed: int) -> np.ndarray:
    """A symmetric positive definite C of a body of 50 to 800 N/m, shape (n, n) [m/N]."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n + 1))
    C = A @ A.T + 1e-3 * np.eye(n)
    scale = 1.0 / np.sqrt(np.diag(C))
    stiffness = rng.uniform(50.0, 800.0, n)
    return np.asarray(C * np.outer(scale, scale) / np.sqrt(np.outer(stiffness, stiffness)))
