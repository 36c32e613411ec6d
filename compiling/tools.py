"""What compiles, found in this environment or fetched for one build."""

from __future__ import annotations

import contextlib
import importlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Generator
from importlib.util import find_spec

from compiling.compiler import TOOLS

_MODULES = ("Cython", "mypyc", "setuptools")  # of `TOOLS`


class ToolsError(Exception):
    """The tools could not be fetched; the text is pip's."""


def are_here() -> bool:
    """Whether this environment has them, as that of a developer does."""
    return all(find_spec(name) is not None for name in _MODULES)


@contextlib.contextmanager
def tools() -> Generator[None, None, None]:
    """Have the tools within the block, also in the processes that it starts.

    Where the environment lacks them pip puts them into a temporary folder, as it does for a build:
    an environment is its owner's, and does not grow by what nobody asked for.

    Raises:
        ToolsError: There is no pip, or no network.
    """
    if are_here():
        yield
        return
    with tempfile.TemporaryDirectory() as folder:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        done = subprocess.run(
            [*pip, "--target", folder, *TOOLS],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        if done.returncode:
            raise ToolsError(f"pip could not fetch {', '.join(TOOLS)}:\n{done.stdout[-4000:]}")
        before = os.environ.get("PYTHONPATH")
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (folder, before)))
        sys.path.insert(0, folder)
        importlib.invalidate_caches()
        try:
            yield
        finally:
            sys.path.remove(folder)
            if before is None:
                del os.environ["PYTHONPATH"]
            else:
                os.environ["PYTHONPATH"] = before
