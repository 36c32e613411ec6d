"""The file of a session in progress, which one process owns, and which nothing overwrites.

The file has its name from the beginning, and is an MCAP file at any time: what a killed process has
left lacks the index at its end, which readers can do without. Each chunk has about one second of a
session, so that no more than that is lost.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

from mcap.writer import CompressionType, Writer

from cohaptic import __version__
from cohaptic.recording.part import Part
from cohaptic.sessions.codec import encode
from cohaptic.sessions.entries import SessionInfo, Written, nanoseconds
from cohaptic.sessions.schemas import BY_ENTRY, CHANNELS, FORM, PROFILE, Schema

if TYPE_CHECKING:
    from cohaptic.sessions.plots import Plotter

# s of a session after which a chunk ends. A killed process loses as much and what was on its way to
# the chunk, together less than the last second; twice as long saves 1 % of the file.
CHUNK = 0.5
# Bytes of a chunk that ends earlier: twice what eight people at 1 kHz give in a second.
CHUNK_SIZE = 4 * 1024 * 1024


class SessionFile:
    """An open file of a session; closing it writes its index.

    Args:
        option: Option by which the user named the file.
        path: Path of the file.
        info: First entry of the session.
        plots: Whether the file also has the messages for Foxglove (`plots.py`).

    Raises:
        SettingError: There is a file of that name, or it cannot be made.
        OSError: The first bytes cannot be written; no file is left behind.
        ValueError: The first entry cannot be represented.
    """

    def __init__(self, option: str, path: Path, info: SessionInfo, *, plots: bool = True) -> None:
        first = encode(info)  # so that one that cannot be encoded leaves no file behind
        self.part = Part.new(option, path)
        self._to_wall = info.to_wall
        self._plotter = _plotter(info) if plots else None
        self._writer = Writer(
            cast(IO[Any], _Sink(self.part)), CHUNK_SIZE, compression=CompressionType.ZSTD
        )
        self._began = math.nan  # time of the first entry of the chunk; NaN before it [s]
        self._channels: dict[str, int] = {}
        self._sequences: dict[int, int] = {}
        self._schemas: dict[str, int] = {}
        try:
            self._begin(info, first)
        except BaseException:  # nobody's data is in it yet
            self.part.remove()
            raise

    def _begin(self, info: SessionInfo, first: bytes) -> None:
        """Write the first chunk: descriptions of all channels, and the first entry."""
        # Without the version of mcap: two runs of one version of cohaptic give the same bytes.
        self._writer.start(PROFILE, f"cohaptic {__version__}; form {FORM}")
        # All in the first chunk: a reader that begins anywhere knows them by reading that one.
        for channel in CHANNELS:
            self._register(channel.topic, channel.encoding, channel.schema)
        self._add(info, first)
        self.flush()

    def add(self, entry: Written) -> None:
        """Append an entry, and end the chunk where it is a second long.

        Raises:
            ValueError, TypeError: The entry cannot be represented; nothing of it is in the file.
            OSError: A chunk cannot be written; the file has those before it.
        """
        self._add(entry, encode(entry))
        if math.isnan(self._began):
            self._began = entry.t
        # Rows come later than what the room does. One whose time is wrong ends a chunk early,
        # which costs little; none can keep a chunk open.
        elif abs(entry.t - self._began) >= CHUNK:
            self.flush()

    def flush(self) -> None:
        """End the chunk, if there is one, and give it to the system.

        Raises:
            OSError: It cannot be written.
        """
        self._began = math.nan
        self._writer.flush()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Write the last chunk and the index, wait until all is on the disk, and close the file.

        Raises:
            OSError: It cannot be written; `part` is still open.
        """
        self._writer.finish()  # type: ignore[no-untyped-call]
        self.part.sync()
        self.part.close()

    def _add(self, entry: Written, data: bytes) -> None:
        topic = BY_ENTRY[type(entry)].topic
        # First what can fail, so that an entry is in the file with its plots, or not at all.
        drawn = () if self._plotter is None else self._plotter.of(entry)
        self._put(self._channels[topic], entry.t, data)
        for each in drawn:
            if each.topic not in self._channels:
                self._register(each.topic, "json", each.schema)
            self._put(self._channels[each.topic], each.t, each.data)

    def _register(self, topic: str, encoding: str, schema: Schema) -> None:
        if schema.name not in self._schemas:
            number = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            self._schemas[schema.name] = number
        channel = self._writer.register_channel(topic, encoding, self._schemas[schema.name])
        self._channels[topic] = channel

    def _put(self, channel: int, t: float, data: bytes) -> None:
        time = nanoseconds(t, self._to_wall)
        sequence = self._sequences[channel] = self._sequences.get(channel, 0) + 1
        self._writer.add_message(channel, time, data, time, sequence & 0xFFFFFFFF)


def _plotter(info: SessionInfo) -> Plotter | None:
    """Return what makes the messages for Foxglove; None where scipy is not installed."""
    try:  # here, since a client can do without scipy
        from cohaptic.sessions.plots import Plotter
    except ImportError:
        return None
    return Plotter(info)


class _Sink:
    """What the library writes to: a part of which it needs to know the length."""

    def __init__(self, part: Part) -> None:
        self._part, self._at = part, 0

    def write(self, data: bytes) -> int:
        if data:
            self._part.write(data)
            self._at += len(data)
        return len(data)

    def tell(self) -> int:
        return self._at

    def flush(self) -> None:
        """Nothing waits here."""
