"""Stand-in for the parts of Cython that kernels use, for kernels that run as plain Python.

Compiled kernels do not import this: to Cython, `cython.nogil` is a statement that gives up the
global interpreter lock.
"""

from __future__ import annotations

from contextlib import nullcontext

nogil = nullcontext()
