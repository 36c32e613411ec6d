"""Compilation of the client's own functions, so that hours of haptics take minutes.

Numba compiles the same source that the client runs; there are no copies.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.extending import register_jitable

F = TypeVar("F", bound=Callable[..., Any])


def usable(function: F) -> F:
    """Let compiled code call `function`; in Python it stays as it is."""
    register_jitable(function)
    return function


def compiled(function: F) -> F:
    """`function`, compiled at its first call: same arguments, same results."""
    return cast(F, numba.njit(function))


def compiled_in_parallel(function: F) -> F:
    """As `compiled`; its loops over `on_all_cores` run side by side."""
    return cast(F, numba.njit(function, parallel=True))


on_all_cores: Callable[[int], range] = cast("Callable[[int], range]", numba.prange)
