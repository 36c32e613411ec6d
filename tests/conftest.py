from __future__ import annotations

import ast
import gc
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).parents[1]

# A test that imports one of these, itself or through a helper, opens sockets, starts processes or
# a browser, or measures time. It is marked `realtime` and does not run beside others.
REALTIME_IMPORTS = (
    "asyncio",
    "cohaptic.clock.SystemClock",
    "cohaptic_client.client.Client",
    "cohaptic_client.loop.handle",
    "cohaptic_client.network.link",
    "cohaptic_server.demo.processes",
    "cohaptic_server.shell",
    "cohaptic_server.upload.process",
    "multiprocessing",
    "playwright",
    "socket",
    "subprocess",
    "threading",
    "websockets",
)

# A busy machine is no failure: no test has a deadline but the suite's own timeout.
settings.register_profile("cohaptic", deadline=None)
# The same examples every time: what lands is judged by the change and not by a draw. Everybody's
# own runs draw anew, and keep what they find as an `@example`.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "cohaptic"))


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark what depends on real time, by what its module imports."""
    if depends_on_real_time(item.path):
        item.add_marker(pytest.mark.realtime)


@cache
def depends_on_real_time(path: Path) -> bool:
    """Whether a test module, its folder's conftest or a helper they import needs real time."""
    todo, seen = [path, path.with_name("conftest.py")], {Path(__file__)}
    while todo:
        source = todo.pop()
        if source in seen or not source.is_file():
            continue
        seen.add(source)
        for name in imported_names(source):
            if any(f"{name}.".startswith(f"{prefix}.") for prefix in REALTIME_IMPORTS):
                return True
            if name.startswith("tests."):
                parts = name.split(".")
                # `from tests.helper import name` names a module and something in it.
                todo += [ROOT.joinpath(*parts[:n]).with_suffix(".py") for n in (-1, len(parts))]
    return False


def imported_names(source: Path) -> Iterator[str]:
    """Dotted names that the statements of a module import."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.fixture(autouse=True, scope="session")
def one_thread() -> Iterator[None]:
    """As on the server: small products spread over threads wait for the slowest of them."""
    with threadpool_limits(limits=1):
        yield


@pytest.fixture(autouse=True)
def no_collection_is_counted(request: pytest.FixtureRequest) -> Iterator[None]:
    """In tests that count work: a collection of garbage calls back whoever listens to it."""
    if request.path.name != "test_work.py":
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
