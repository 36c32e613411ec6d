"""Compiles modules of the packages from their own Python source (docs/design/toolchain.md).

    python -m compiling          what `make compiled` and the build hook run

It needs a C compiler, and Cython, mypy with mypyc, and setuptools, which pip fetches for it where
the environment lacks them. Nothing is compiled in the source
tree: sources are copied to a temporary folder, and only finished extensions come back.
"""
