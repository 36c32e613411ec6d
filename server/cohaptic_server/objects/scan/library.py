"""Imports the libraries of the extra `scans`, or says which one is missing."""

from __future__ import annotations

import importlib
from typing import Any

from cohaptic.errors import BodyError


def library(module: str, package: str, what: str) -> Any:
    """A module of a package that may be missing.

    Args:
        module: Its name.
        package: Under which it is installed.
        what: It is needed for, at the start of a sentence.

    Raises:
        BodyError: It is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise BodyError(
            f"{what} needs {package}; install it with: pip install 'cohaptic[scans]'"
        ) from error
