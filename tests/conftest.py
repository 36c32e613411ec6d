from __future__ import annotations

import gc
import logging
import os
import signal
import sys
import threading
from collections.abc import Iterator
from importlib import import_module
from multiprocessing.process import BaseProcess

import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling, Scheduling

from cohaptic.compiled import describe, is_complete
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from tests.give_up import give_up
from tests.time_out import pytest_timeout_set_timer as pytest_timeout_set_timer

# A busy machine is no failure: no test has a deadline but the suite's own timeout. By day laws are
# tried on the same examples, so that a change is judged and not a draw; new ones are drawn at
# night, and what those find is kept as an `@example`.
settings.register_profile("quick", deadline=None, derandomize=True, max_examples=20)
settings.register_profile("deep", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "quick"))
# What the tests run of the campaign's kernel takes less time than its last optimisations do.
os.environ.setdefault("NUMBA_OPT", "2")

# A test with one of these marks may touch the machine: see CONTRIBUTING.md.
LIVE = ("live", "alone", "night")
# What only a live test does, by the names of Python's audit events.
TOUCHES = frozenset({
    "os.fork", "os.forkpty", "os.posix_spawn", "os.system", "socket.bind", "socket.connect",
    "socket.sendto", "subprocess.Popen",
})  # fmt: skip
SPAWN = "multiprocessing"  # whose way of starting a process has no event
touched: set[str] = set()


def pytest_configure() -> None:
    """What tests start hears of Ctrl-C, also where a shell started this in its background.

    Such a shell has it ignored, and so would all that is started from here.
    """
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.addaudithook(lambda event, _: touched.add(event) if event in TOUCHES else None)
    start = BaseProcess.start

    def start_and_note(process: BaseProcess) -> None:
        touched.add(SPAWN)
        start(process)

    BaseProcess.start = start_and_note  # type: ignore[assignment]


class FewBrowsers(LoadScopeScheduling):  # type: ignore[misc]  # xdist has no types
    """Deals out single tests, but those of pages to two processes, a file to the one or the other.

    Software draws, and a third browser would cost the other two as much time as it saves; and each
    process starts one browser and one server to look at.
    """

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return f"browser {len(file) % 2}" if "/browser/" in file else nodeid


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> Scheduling | None:
    """`--dist loadscope` is ours: `loadgroup` does nothing with pytest 9.2, and says nothing."""
    return FewBrowsers(config, log) if config.getoption("dist") == "loadscope" else None


def pytest_make_parametrize_id(val: object, argname: str) -> str | None:
    """Name bytes by their argument and place, and leave other values to pytest.

    Packed bytes may hold the second in which they were packed: two processes that collect the same
    tests would have other names for them, and none would run.
    """
    return argname if isinstance(val, bytes) else None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Before any fixture: the first test of a module answers for what its fixtures start."""
    touched.clear()


def pytest_itemcollected(item: pytest.Item) -> None:
    """A smoke test is a live one that `make test` runs too."""
    if item.get_closest_marker("smoke") and not any(map(item.get_closest_marker, LIVE)):
        raise pytest.UsageError(f"{item.nodeid} is marked smoke, which is for live tests")


@pytest.fixture(autouse=True)
def only_live_tests_touch_the_machine(request: pytest.FixtureRequest) -> Iterator[None]:
    """A test that opens sockets or starts processes has to be marked, and so finds its tier."""
    yield
    if not any(map(request.node.get_closest_marker, LIVE)):
        assert touched == set(), f"mark this test live: it did {', '.join(sorted(touched))}"


@pytest.fixture(scope="session")
def balloon() -> Balloon:
    """The balloon that the server serves."""
    return Balloon()


@pytest.fixture(scope="session")
def small_balloon() -> Balloon:
    """A coarser one, for tests that take many ticks."""
    return Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))


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


@pytest.fixture(scope="session")
def kernels() -> None:
    """For tests that take minutes where the loops over arrays are plain Python."""
    import_module("cohaptic_server")  # puts compiled kernels in use
    if not is_complete("kernels"):
        give_up(f"kernels: {describe('kernels')}")


@pytest.fixture
def terminal() -> Iterator[None]:
    """As in a terminal: with `nohup` SIGHUP is ignored, here and in all that a test starts."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


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
