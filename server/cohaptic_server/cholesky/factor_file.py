"""A Cholesky factor as named arrays, for a file, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.factor import Factor, FactorFront
from cohaptic_server.numeric import Floats, Ints


def to_arrays(factor: Factor) -> dict[str, npt.NDArray[Any]]:
    """All arrays of a factor by name, for `from_arrays`; the blocks are not copied."""
    fronts = factor.fronts
    table = [[len(f.own), len(f.border), f.parent, f.retained] for f in fronts]
    arrays: dict[str, npt.NDArray[Any]] = {
        "fronts": np.array(table, dtype=np.int64),
        "front_of": factor.front_of,
        "own": np.concatenate([front.own for front in fronts]),
        "border": np.concatenate([front.border for front in fronts]),
    }
    for k, front in enumerate(fronts):
        if front.retained:
            arrays[f"lower{k}"], arrays[f"carry{k}"] = front.lower, front.carry
    return arrays


def from_arrays(arrays: Mapping[str, npt.NDArray[Any]]) -> Factor:
    """The factor of `to_arrays`; its blocks may be read-only, or mapped from a file.

    Raises:
        BodyError: The arrays do not fit together.
    """
    try:
        front_of = np.asarray(arrays["front_of"], dtype=np.int64)
        fronts = _fronts(arrays, 3 * len(front_of))
    except (KeyError, ValueError, IndexError) as error:
        raise BodyError(f"this is no factor: {error}") from error
    if not _within(front_of, len(fronts)):
        raise BodyError("this is no factor: a node is in a front that is not there")
    return Factor(fronts, front_of)


def _fronts(arrays: Mapping[str, npt.NDArray[Any]], size: int) -> list[FactorFront]:
    """Fronts of a stored factor of `size` unknowns.

    Raises:
        ValueError: The arrays do not fit together.
        KeyError: An array is missing.
    """
    table = np.asarray(arrays["fronts"], dtype=np.int64).reshape(-1, 4)
    owns = np.split(np.asarray(arrays["own"], dtype=np.int64), np.cumsum(table[:, 0])[:-1])
    borders = np.split(np.asarray(arrays["border"], dtype=np.int64), np.cumsum(table[:, 1])[:-1])
    nothing: Floats = np.empty((0, 0))
    fronts: list[FactorFront] = []
    for k, (own, border) in enumerate(zip(owns, borders, strict=True)):
        a, b, parent, kept = table[k].tolist()
        lower, carry = (arrays[f"lower{k}"], arrays[f"carry{k}"]) if kept else (nothing, nothing)
        shapes = ((a, a), (b, a)) if kept else ((0, 0), (0, 0))
        if (len(own), len(border), lower.shape, carry.shape) != (a, b, *shapes):
            raise ValueError(f"front {k} has blocks of {lower.shape} and {carry.shape}")
        if parent != -1 and not k < parent < len(owns):
            raise ValueError(f"front {k} has front {parent} above it")
        if not (_within(own, size) and _within(border, size)):
            raise ValueError(f"front {k} has places outside of the matrix")
        fronts.append(FactorFront(own, border, lower, carry, parent, bool(kept)))
    return fronts


def _within(indices: Ints, count: int) -> bool:
    return not len(indices) or bool(indices.min() >= 0 and indices.max() < count)
