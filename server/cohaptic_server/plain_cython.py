"""What kernels use of Cython, where it is not installed and they run as plain Python.

Compiled kernels do not import this: to Cython, `cython.nogil` is a statement that gives up the
global interpreter lock.
"""

from __future__ import annotations

from contextlib import nullcontext

nogil = nullcontext()
