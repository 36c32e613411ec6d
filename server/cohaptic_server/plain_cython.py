"""Replacement for the parts of Cython that kernels need when they run as plain Python.

Compiled kernels do not import this module: Cython itself treats `cython.nogil` as a statement that
releases the global interpreter lock.
"""

from __future__ import annotations

from contextlib import nullcontext

nogil = nullcontext()
