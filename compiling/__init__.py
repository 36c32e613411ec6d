"""Compiles modules of the packages from their own Python source (docs/decisions/0024).

    python -m compiling      what `make compiled` and the build hook run

It needs Cython, mypy with mypyc, setuptools and a C compiler. Nothing is compiled in the source
tree: sources are copied to a temporary folder, and only finished extensions come back.
"""
