"""Dense operations on the fronts of a factor, for kernels that are not compiled.

Matrices lie column by column in a one-dimensional array `values`, from the index `at` on: the
Cholesky factor L (n, n) of a front's own unknowns, and behind it the rows B (m, n) of its border.
Right-hand sides lie row by row.

Compiled kernels call `dense_calls.pxd` in place of this module: the same routines of BLAS and
LAPACK, called without Python at the addresses that scipy publishes for this purpose.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.linalg import blas, cython_blas, cython_lapack, lapack

from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Ints

_ROUTINES = (
    (cython_lapack, "potrf"),
    (cython_blas, "trsm"),
    (cython_blas, "syrk"),
    (cython_blas, "gemm"),
)


@cache
def routines(single: bool) -> Ints:
    """Return the addresses of potrf, trsm, syrk and gemm, shape (4,).

    Args:
        single: Whether the routines are those for single precision; otherwise for double.
    """
    letter = "s" if single else "d"
    name_of, pointer_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer_of.restype, pointer_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    capsules = [module.__pyx_capi__[letter + name] for module, name in _ROUTINES]
    return np.array([pointer_of(c, name_of(c)) for c in capsules], dtype=np.uint64).view(np.int64)


def cholesky(routines: Ints, values: AnyFloats, at: int, n: int) -> int:
    """Replace the lower triangle of the matrix (n, n) at `at` by its Cholesky factor L.

    Returns:
        0 on success; another number if the matrix is not positive definite.
    """
    del routines
    a = _matrix(values, at, n, n)
    factor, failed = (lapack.spotrf if values.itemsize == 4 else lapack.dpotrf)(a, lower=1, clean=0)
    a[...] = factor
    return int(failed)


def divide_rows(routines: Ints, values: AnyFloats, at: int, n: int, m: int) -> None:
    """Replace the border's rows B (m, n), behind the factor L (n, n) at `at`, by B inv(L')."""
    del routines
    B = _matrix(values, at + n * n, m, n)
    B[...] = _trsm(values)(1.0, _matrix(values, at, n, n), B, side=1, lower=1, trans_a=1)


def negative_square(
    routines: Ints, values: AnyFloats, at: int, n: int, m: int, out: AnyFloats, to: int
) -> None:
    """Write the lower triangle of -B B' (m, m) to `out` at `to`; B as in `divide_rows`."""
    del routines
    B, square = _matrix(values, at + n * n, m, n), _matrix(out, to, m, m)
    lower = np.tril_indices(m)
    square[lower] = -(B @ B.T)[lower]


def forward(routines: Ints, values: AnyFloats, at: int, n: int, x: AnyFloats, row: int) -> None:
    """Replace the rows y = x[row : row + n] by inv(L) y, with the factor L (n, n) at `at`."""
    del routines
    own = x[row : row + n]
    own[...] = _trsm(values)(1.0, _matrix(values, at, n, n), own.T, side=1, lower=1, trans_a=1).T


def backward(routines: Ints, values: AnyFloats, at: int, n: int, x: AnyFloats, row: int) -> None:
    """Replace the rows y = x[row : row + n] by inv(L') y, with the factor L (n, n) at `at`."""
    del routines
    own = x[row : row + n]
    own[...] = _trsm(values)(1.0, _matrix(values, at, n, n), own.T, side=1, lower=1).T


def product(
    routines: Ints,
    values: AnyFloats,
    at: int,
    n: int,
    m: int,
    x: AnyFloats,
    row: int,
    out: AnyFloats,
) -> None:
    """Write B y to the first m rows of `out`, for y = x[row : row + n]; B as in `divide_rows`."""
    del routines
    out[:m] = _matrix(values, at + n * n, m, n) @ x[row : row + n]


def subtract_product(
    routines: Ints,
    values: AnyFloats,
    at: int,
    n: int,
    m: int,
    x: AnyFloats,
    row: int,
    by: AnyFloats,
) -> None:
    """Subtract B' z from x[row : row + n], for z = by[:m]; B as in `divide_rows`."""
    del routines
    x[row : row + n] -= _matrix(values, at + n * n, m, n).T @ by[:m]


def _matrix(values: AnyFloats, at: int, rows: int, columns: int) -> AnyFloats:
    return values[at : at + rows * columns].reshape((rows, columns), order="F")


def _trsm(values: AnyFloats) -> Callable[..., AnyFloats]:
    """Return BLAS's routine that divides by a triangular matrix, in the precision of `values`."""
    return blas.strsm if values.itemsize == 4 else blas.dtrsm
