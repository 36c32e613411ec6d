"""Imports the libraries of the extra `scans`, or says which one is missing."""

from __future__ import annotations

import importlib
from typing import Any

from cohaptic.errors import BodyError


def library(module: str, package: str, what: str) -> Any:
    """Import a module of a package that may be missing.

    Args:
        package: Name of the package to install.
        what: Purpose of the module, as the start of a sentence.

    Raises:
        BodyError: The package is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise BodyError(
            f"{what} needs {package}; install it with: pip install 'cohaptic[scans]'"
        ) from error
