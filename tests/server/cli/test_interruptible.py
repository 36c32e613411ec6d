"""Ctrl-C ends a block of work, also where Python forgets what is raised."""

from __future__ import annotations

import signal
import sys
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


def forget(_problem: sys.UnraisableHookArgs) -> None:
    pass


FORGOTTEN = pytest.mark.parametrize("comes", [in_a_finaliser, in_a_callback])


@FORGOTTEN
def test_python_forgets_what_is_raised_there(
    comes: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The premise: without the block nothing ends."""
    monkeypatch.setattr(sys, "unraisablehook", forget)
    comes()


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
def test_the_end_of_the_block_does_too(comes: Callable[[], None]) -> None:
    with pytest.raises(KeyboardInterrupt), interruptible():
        comes()


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


def test_afterwards_ctrl_c_means_what_it_meant() -> None:
    hook = sys.unraisablehook
    with interruptible():
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert sys.unraisablehook is hook


def test_other_faults_of_a_finaliser_are_told_as_usual(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[type[BaseException]] = []

    def note(problem: sys.UnraisableHookArgs) -> None:
        told.append(problem.exc_type)

    monkeypatch.setattr(sys, "unraisablehook", note)

    class Faulty:
        def __del__(self) -> None:
            raise ValueError

    thing = Faulty()
    with interruptible():
        del thing
    assert told == [ValueError]


def test_where_it_means_something_else_already_nothing_is_changed() -> None:
    heard: list[int] = []

    def note(number: int, _frame: object) -> None:
        heard.append(number)

    before = signal.signal(signal.SIGINT, note)
    try:
        with interruptible() as check:
            signal.raise_signal(signal.SIGINT)
            check()
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [signal.SIGINT]


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
