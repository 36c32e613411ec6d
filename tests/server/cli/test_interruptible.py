"""Ctrl-C ends a block of work, also where Python forgets what is raised."""

from __future__ import annotations

import signal
import threading
import weakref
from collections.abc import Callable

import pytest

from cohaptic_server.cli.progress_bar import INTERRUPTED, interruptible, progress_bar


class Interrupted:
    """Something whose finaliser Ctrl-C comes into."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def in_a_finaliser() -> None:
    thing = Interrupted()
    del thing


def in_a_callback() -> None:
    """Of a weak reference: the other place of which Python says that it forgets."""

    class Thing:
        pass

    thing = Thing()
    weakref.finalize(thing, signal.raise_signal, signal.SIGINT)
    del thing


FORGOTTEN = pytest.mark.parametrize("comes", [in_a_finaliser, in_a_callback])


@FORGOTTEN
def test_the_next_check_ends_the_work(
    comes: Callable[[], None], capsys: pytest.CaptureFixture[str]
) -> None:
    after: list[str] = []

    def work() -> None:
        with interruptible() as check:
            check()
            comes()
            after.append("the line after it")
            check()
            after.append("the line after the check")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert after == ["the line after it"]
    assert capsys.readouterr().err == ""


@FORGOTTEN
def test_a_preparation_ends_in_one_sentence_at_its_next_step(
    comes: Callable[[], None], capsys: pytest.CaptureFixture[str]
) -> None:
    steps: list[float] = []

    def work() -> None:
        with progress_bar("preparing ball.stl") as progress:
            for step in (0.25, 0.5, 0.75, 1.0):
                progress("factor", step)
                steps.append(step)
                if step == 0.5:
                    comes()

    with pytest.raises(SystemExit) as ended:
        work()
    assert (ended.value.code, steps) == (130, [0.25, 0.5])
    assert capsys.readouterr().err == INTERRUPTED + "\n"


@FORGOTTEN
def test_so_does_what_goes_wrong_behind_it(comes: Callable[[], None]) -> None:
    """A terminal sends it to children too, whose end is an error of its own."""

    def work() -> None:
        with interruptible():
            comes()
            raise RuntimeError

    with pytest.raises(KeyboardInterrupt):
        work()


def test_anywhere_else_it_ends_at_once() -> None:
    after: list[str] = []

    def work() -> None:
        with interruptible():
            signal.raise_signal(signal.SIGINT)
            after.append("the next line")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert after == []


def test_another_thread_works_on() -> None:
    done: list[bool] = []

    def work() -> None:
        with interruptible() as check:
            check()
            done.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [True]
