"""Both forms of a kernel: compiled, and as the Python that it was made from."""

from __future__ import annotations

from importlib import import_module
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from types import ModuleType

import cohaptic_server  # puts compiled kernels in use
from cohaptic.compiled import describe, source_path
from tests.give_up import give_up

assert cohaptic_server


def compiled_module(name: str) -> ModuleType:
    """A kernel, compiled; the test is skipped where it is not, and fails in CI."""
    module = import_module(name)
    spec = module.__spec__
    if spec is None or not isinstance(spec.loader, ExtensionFileLoader):
        give_up(f"{name} is not compiled; kernels: {describe('kernels')}")
    return module


def plain_module(name: str) -> ModuleType:
    """A kernel as plain Python; others that it imports are as they are in use."""
    path = source_path(name.replace(".", "/") + ".py")
    assert path is not None
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
