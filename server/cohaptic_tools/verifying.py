"""Computes the patches of a session file again, for `cohaptic replay --verify`."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import SettingError, one_line
from cohaptic.sessions.entries import SessionInfo
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic_server.bodies.body import Body
from cohaptic_server.cli.object_options import ObjectOptions
from cohaptic_server.cli.progress_bar import progress_bar
from cohaptic_server.cli.serving import build_served
from cohaptic_server.progress import TimeLeft
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.verification import NotVerifiable, Verdict, verify
from cohaptic_server.touchable import is_file, names

_PATIENCE = 2.0  # s after which a person wants to know whether it goes on
_STEP = 10.0  # s between two lines of a log, in which nothing goes away again


def verify_file(path: Path, body: Path | None) -> Verdict:
    """Compare the patches of a session file with those of its inputs, and show the progress.

    On a terminal that is a bar, otherwise a line of the log now and then.

    Args:
        path: The session file.
        body: File of the object, if the session had one of its own.

    Raises:
        SettingError: The file cannot be read, or `body` is missing.
        NotVerifiable: The patches cannot be computed again.
        BodyError: The object cannot be made.
    """
    outline = Outline.of(path)
    made = _made_again(outline.info, body)
    verdict = Verdict()
    # One thread, as in the server: several would add numbers in another order.
    title = f"verifying {one_line(path.name)}"
    log, is_terminal = logged(SystemClock(), title), sys.stderr.isatty()
    with threadpool_limits(limits=1), progress_bar(title) as progress:
        for t, so_far in verify(read_entries(path), made):
            verdict = so_far
            share = min(1.0, max(0.0, (t - outline.first) / max(outline.seconds, 1e-9)))
            progress("computing its patches again", share)
            if not is_terminal:
                log(share)
    return verdict


def logged(clock: Clock, title: str) -> Callable[[float], None]:
    """Return a function of the finished fraction of a work, 0 to 1, that logs it now and then.

    A work of less than two seconds logs nothing.

    Args:
        clock: Clock by which the work takes long; the work begins now.
        title: What is worked at.
    """
    began = clock.now()
    left, due = TimeLeft(began), began + _PATIENCE

    def log(share: float) -> None:
        nonlocal due
        now = clock.now()
        if now >= due:
            due = now + _STEP
            logging.info("%s: %.0f %% %s", title, 100.0 * share, left.words(share, now))

    return log


def _made_again(info: SessionInfo, body: Path | None) -> Body:
    """Return the object of a session as its server made it.

    The file that a session names is not opened unless the user names it, too: the session may come
    from anybody.
    """
    made: dict[str, Any] = dict(info.settings)
    name = made.get("body")
    if not isinstance(name, str):
        which = one_line(str(made.get("class", info.body.get("name"))), 60)
        why = f"a program made its object ({which}); there use cohaptic_server.verify_session"
        raise NotVerifiable(why)
    if body is None and (is_file(name) or name not in names()):
        limit = f"given as the object's file, {one_line(name, 100)}"
        raise SettingError("--body", "not given", limit)
    try:
        options = ObjectOptions(dict(made.get("object", {})), bool(made.get("auto", False)))
        hz = round(1.0 / info.simulation_period, 9)
        users, relaxation = made.get("users"), float(made.get("relaxation", 0.0))
        settings = ServerSettings(simulation_hz=hz, body=name if body is None else str(body))
        nonlinear = made.get("nonlinear") is True
        return build_served(settings, options, users, relaxation * hz, nonlinear=nonlinear)
    except (ArithmeticError, AttributeError, TypeError, ValueError) as error:
        raise NotVerifiable(f"it does not say how its object was made ({error})") from error


def in_words(verdict: Verdict) -> str:
    """Return a sentence on a comparison."""
    if not verdict.patches and not verdict.missing:
        return "there is no patch in the session"
    if verdict.cut_short:
        return f"the file is cut short; until there {in_words(replace(verdict, cut_short=False))}"
    same = f"{verdict.identical} of {verdict.patches} patches are the same to the last bit"
    if verdict.missing:
        return f"{verdict.missing} patches are in the file alone, or not in it; {same}"
    if verdict.identical == verdict.patches:
        return f"all {verdict.patches} patches are the same to the last bit"
    return f"{same}; the largest difference is {verdict.worst:.2g} ({verdict.where})"
