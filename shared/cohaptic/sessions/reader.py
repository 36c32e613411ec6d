"""The entries of a session file in the order of their times, and what is in it at a glance.

Files of killed processes are read as far as they reach. A stranger's file costs no more memory than
some chunks; whatever is wrong with it is a `SettingError` that names the file.
"""

from __future__ import annotations

import contextlib
import math
from collections import Counter
from collections.abc import Collection, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic.sessions.codec import decode
from cohaptic.sessions.container import Container, Item, Span, Unreadable
from cohaptic.sessions.entries import (
    MAX_TIME,
    Damage,
    Entry,
    Joined,
    LeftOut,
    Mark,
    RowsLost,
    SessionInfo,
    Written,
    nanoseconds,
)
from cohaptic.sessions.schemas import BY_ENTRY, BY_TOPIC, CHANNELS, FORM

# Bytes of messages that may wait for earlier ones in later chunks: rows come half a second late.
# Only a stranger's file, with times at random, has more.
_WAITING = 256 * 1024 * 1024
_GLANCE = (SessionInfo, Joined, Mark, RowsLost, LeftOut)  # what an outline reads


@dataclass(frozen=True, slots=True)
class Outline:
    """What is in a session file.

    Args:
        info: First entry.
        users: Names by number of the user.
        first: Time of the first message on the server's clock [s].
        last: Time of the last message [s].
        marks: All marks, in order.
        counts: Number of entries by the name of their class, such as "Heard".
        rows_lost: Rows that did not arrive, by number of the user.
        left_out: Entries for which the disk was too slow.
        complete: Whether the file was closed; if not, its process was killed.
        damaged: Number of damaged chunks among those that were read for this.
    """

    info: SessionInfo
    users: dict[int, str]
    first: float
    last: float
    marks: tuple[Mark, ...]
    counts: dict[str, int]
    rows_lost: dict[int, int]
    left_out: int
    complete: bool
    damaged: int

    @property
    def seconds(self) -> float:
        """Length of the session [s]."""
        return self.last - self.first

    @classmethod
    def of(cls, path: Path) -> Outline:
        """Read the outline of a file: its index, and the few chunks with what is listed here.

        Raises:
            SettingError: The file cannot be read, or holds no session.
        """
        with _opened(path) as container:
            return _outline(container)


def read_entries(
    path: Path,
    start: float | None = None,
    end: float | None = None,
    only: Collection[type[Written]] | None = None,
) -> Iterator[Entry]:
    """Yield the entries of a session file in the order of their times.

    Entries of one time come in the order in which they were written. A stretch that is damaged or
    cut short is yielded as `Damage`.

    Args:
        path: Path of the file.
        start: Earliest time of an entry on the server's clock [s]; None for the first. A block of
            rows has the time of its first row.
        end: Time before which the entries are [s]; None for all.
        only: Classes of the entries to yield; None for all. Others are not decoded, and chunks
            without any of these are not read.

    Raises:
        SettingError: The file cannot be read, holds no session, or has an entry that no writer
            writes.
    """
    with _opened(path) as container:
        yield from _entries(container, start, end, only)


@contextlib.contextmanager
def _opened(path: Path) -> Generator[Container, None, None]:
    """Open a file, and give whatever is wrong with it a name.

    Raises:
        SettingError: It cannot be read, or holds no session.
    """
    try:
        if path.exists() and not path.is_file():  # a pipe would keep the reader waiting
            raise SettingError("session", path, "a file")
        with path.open("rb") as file:
            container = Container.of(file)
            _check_form(container.library)
            yield container
    except Unreadable as error:
        raise SettingError("session", path, str(error)) from error
    except OSError as error:
        limit = f"a file to read ({error.strerror or error})"
        raise SettingError("session", path, limit) from error


def _check_form(library: str) -> None:
    _, ours, form = library.partition("; form ")
    if ours and form.isdecimal() and int(form[:9]) > FORM:
        raise Unreadable(f"a file of form {FORM} or older; a newer version of cohaptic reads it")


def _entries(
    container: Container,
    start: float | None,
    end: float | None,
    only: Collection[type[Written]] | None,
) -> Iterator[Entry]:
    info = _info(container)
    low = -1.0 if start is None else _bound(start, info)
    high = math.inf if end is None else _bound(end, info)
    read = container.spans if only is None else _with(container, *only)
    spans = [span for span in read if span.end >= low and span.start <= high]
    # What comes before all that later chunks have can go; rows come in later than their times.
    horizon, later = list[float](), math.inf
    for span in reversed(spans):
        horizon.append(later)
        later = min(later, span.start)
    waiting = list[tuple[int, int, Entry, int]]()
    size = count = 0
    for span, limit in zip(spans, reversed(horizon), strict=True):
        try:
            items = container.items(span)
        except Unreadable:
            items = []
            gap = Damage(_seconds(span.start, info), cut_short=False)
            waiting.append((span.start, count, gap, 0))
            count += 1
        for item in items:
            if (entry := _entry(container, item, only)) is None:
                continue
            if (start is None or entry.t >= start) and (end is None or entry.t < end):
                weight = len(item.data) + 100
                waiting.append((item.time, count, entry, weight))
                size += weight
                count += 1
        if not span.whole:
            gap = Damage(_seconds(span.end, info), cut_short=True)
            waiting.append((2**64, count, gap, 0))
            count += 1
        if size > _WAITING:
            raise Unreadable("a file whose entries are about in the order of their times")
        waiting.sort(key=lambda each: each[:2])
        ready = sum(each[0] < limit for each in waiting) if limit < math.inf else len(waiting)
        for _, _, first, weight in waiting[:ready]:
            size -= weight
            yield first
        del waiting[:ready]
    if end is None and not container.complete and all(span.whole for span in container.spans[-1:]):
        # The rest is missing from the end of a chunk on, as of a process that was killed.
        last = max((span.end for span in container.spans), default=0)
        yield Damage(_seconds(last, info), cut_short=True)


def _bound(t: float, info: SessionInfo) -> float:
    """Return a time that a user has given as the index has it [ns]; it may be infinite."""
    return nanoseconds(t, info.to_wall) if abs(t) <= MAX_TIME else t


def _seconds(time: int, info: SessionInfo) -> float:
    """Return a time of the index on the server's clock [s], to a nanosecond."""
    return (time - round(info.to_wall * 1e9)) / 1e9


def _entry(
    container: Container, item: Item, only: Collection[type[Written]] | None = None
) -> Written | None:
    """Return the entry of a message; None for one of another channel, or of a class not in `only`.

    Raises:
        Unreadable: No writer writes such a message.
    """
    topic, encoding = container.channels.get(item.channel, ("", ""))
    channel = BY_TOPIC.get(topic)
    if channel is None or channel.encoding != encoding:
        return None
    if only is not None and channel.entry not in only:
        return None
    try:
        return decode(channel, item.data)
    except ValueError as error:
        limit = f"a file whose entries are right (one on {topic}: {str(error)[:200]})"
        raise Unreadable(limit) from error


def _info(container: Container) -> SessionInfo:
    """Return the first entry; as a side effect the channels of the first chunk are known.

    Raises:
        Unreadable: There is none.
    """
    for span in container.spans[:1] if not container.complete else _with(container, SessionInfo):
        for item in container.items(span):
            if isinstance(entry := _entry(container, item), SessionInfo):
                return entry
    raise Unreadable("a file with a session of cohaptic")


def _with(container: Container, *kinds: type[Written]) -> list[Span]:
    """Return the chunks that have entries of some kinds, or of which nobody knows it."""
    topics = {BY_ENTRY[kind].topic for kind in kinds}
    numbers = {number for number, (topic, _) in container.channels.items() if topic in topics}
    return [
        span
        for span in container.spans
        if span.counts is None or not numbers.isdisjoint(span.counts)
    ]


def _outline(container: Container) -> Outline:
    info = _info(container)
    users, marks, left_out, damaged = dict[int, str](), list[Mark](), 0, 0
    rows_lost, unindexed = Counter[int](), Counter[int]()
    for span in _with(container, *_GLANCE):
        try:
            items = container.items(span)
        except Unreadable:
            damaged += 1
            continue
        if span.counts is None:
            unindexed.update(item.channel for item in items)
        for item in items:
            topic, _ = container.channels.get(item.channel, ("", ""))
            if topic not in BY_TOPIC or BY_TOPIC[topic].entry not in _GLANCE:
                continue
            match _entry(container, item):
                case Joined() as joined:
                    users[joined.user] = joined.name
                case Mark() as mark:
                    marks.append(mark)
                case RowsLost() as lost:
                    rows_lost[lost.user] += lost.count
                case LeftOut() as left:
                    left_out += left.count
                case _:
                    pass
    totals = container.totals
    if not totals:
        totals = unindexed
        for span in container.spans:
            totals.update(span.counts or {})
    names = {channel.topic: channel.entry.__name__ for channel in CHANNELS}
    counts = Counter[str]()
    for number, count in totals.items():
        topic, _ = container.channels.get(number, ("", ""))
        if topic in names:
            counts[names[topic]] += count
    first = min((span.start for span in container.spans), default=0)
    last = max((span.end for span in container.spans), default=0)
    marks.sort(key=lambda mark: mark.t)
    return Outline(
        info, users, _seconds(first, info), _seconds(last, info), tuple(marks), dict(counts),
        dict(rows_lost), left_out, container.complete, damaged,
    )  # fmt: skip
