"""Import the public names of a package only when they are first used (PEP 562).

The haptic loop's process imports the packages and must not load numpy or the network code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(
    namespace: dict[str, Any], homes: Mapping[str, str]
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Make `__getattr__` and `__dir__` for a package that imports its public names lazily.

    Args:
        namespace: `globals()` of the package, with its `__all__`.
        homes: Module that defines each public name, by that name.

    Returns:
        The two functions `__getattr__` and `__dir__`.
    """
    package = namespace["__name__"]

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = namespace[name] = getattr(import_module(homes[name]), name)
        return value

    return get, lambda: sorted({*namespace, *namespace["__all__"]})
