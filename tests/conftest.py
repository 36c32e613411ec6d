from __future__ import annotations

import ast
import gc
import logging
import os
import signal
import threading
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).parents[1]

# What hands do in the moments after an event is asserted by the wall's clock: a test that imports
# one of these, itself or by a helper, is marked `realtime` and runs alone.
HANDS = (
    "cohaptic_client.client.Client",
    "cohaptic_client.loop.handle",
    "cohaptic_server.demo.processes.Stage",
)
# So is one that imports one of these, to open sockets, start processes or a browser, or read the
# time, unless it is marked `patient`: it waits as long as it takes, and asserts nothing that a slow
# machine changes. Of no use beside others is a process that stands back for them, as that of an
# upload and that of a solid's columns do: it waits for the end of the other tests.
REALTIME_IMPORTS = (
    *HANDS,
    "asyncio",
    "cohaptic.clock.SystemClock",
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
# What the tests run of the campaign's kernel takes less time than its last optimisations do.
os.environ.setdefault("NUMBA_OPT", "2")


def pytest_configure() -> None:
    """What tests start hears of Ctrl-C, also where a shell started this in its background.

    Such a shell has it ignored, and so would all that is started from here.
    """
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="run the tests that are marked long too")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what takes long, unless it is asked for."""
    if config.option.long:
        return
    short = [item for item in items if item.get_closest_marker("long") is None]
    config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("long")])
    items[:] = short


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Where only tests in real time are wanted, import no module that has none: most have none."""
    if config.option.markexpr != "realtime" or not collection_path.name.startswith("test_"):
        return None
    has_mark = "mark.realtime" in collection_path.read_text(encoding="utf-8")
    return None if has_mark or realtime_imports(collection_path) else True


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark what depends on real time, by what its module imports."""
    found = realtime_imports(item.path)
    if item.get_closest_marker("patient") is None:
        if found:
            item.add_marker(pytest.mark.realtime)
    elif hands := found.intersection(HANDS):
        raise pytest.UsageError(f"{item.nodeid} is patient, yet imports {', '.join(hands)}")


@cache
def realtime_imports(path: Path) -> frozenset[str]:
    """What of `REALTIME_IMPORTS` a test module, its folder's conftest or their helpers import."""
    todo, seen, found = [path, path.with_name("conftest.py")], {Path(__file__)}, set[str]()
    while todo:
        source = todo.pop()
        if source in seen or not source.is_file():
            continue
        seen.add(source)
        for name in imported_names(source):
            found |= {prefix for prefix in REALTIME_IMPORTS if f"{name}.".startswith(f"{prefix}.")}
            if name.startswith("tests."):
                parts = name.split(".")
                # `from tests.helper import name` names a module and something in it.
                todo += [ROOT.joinpath(*parts[:n]).with_suffix(".py") for n in (-1, len(parts))]
    return frozenset(found)


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
def log_of_nobody_else() -> Iterator[None]:
    """A command that a test runs in this process sets up its log, on a stream that ends with it."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:] = [handler for handler in root.handlers if handler in handlers]
    root.setLevel(level)


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
