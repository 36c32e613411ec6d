"""Keeps the recording of a room elsewhere, for `with cohaptic.record(...)`."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Generator
from concurrent.futures import Future
from pathlib import Path

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from cohaptic.errors import CohapticError, RemoteProtocolError, ServerLost
from cohaptic.protocol.messages import encode_control
from cohaptic.sessions.entries import PassedOver, SessionInfo, Ticked
from cohaptic.sessions.recorder import SessionRecorder, open_recorder
from cohaptic.sessions.stream import (
    MAX_BYTES,
    SUBPROTOCOL,
    EndRecording,
    RecordRequest,
    decode_batch,
    decode_error,
)
from cohaptic_client.address import room_at
from cohaptic_client.marking import keep_time
from cohaptic_client.moderation import opened
from cohaptic_client.network.conversation import Refused
from cohaptic_client.network.marks import PACE, MarksOut, Value
from cohaptic_client.network.server_clock import ServerClock

_PATIENCE = 15.0  # s for the first entry; a server sends it within a tenth of a second
_ENDS = (1000, 1001)  # as asked for, or since the server stops


class RoomRecording:
    """A recording that this program keeps; [`record`][cohaptic.record] makes it.

    Args:
        target: Session file that does not exist yet, or a folder in which it gets a name.
        url: Address of the room.
        token: Token that may record; empty for none.
        ca_file: File with the certificates to trust; empty for the system's certificates.
    """

    def __init__(self, target: str, url: str, token: str, ca_file: str) -> None:
        self._target, self._url, self._token, self._ca_file = target, url, token, ca_file
        self._begun: Future[SessionRecorder] = Future()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._marks = MarksOut()
        self._ending = threading.Event()  # the block is over
        self._ended: Future[None] = Future()
        self._thread = threading.Thread(target=self._work, name="recording", daemon=True)

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self._begun.result().path

    @property
    def recording(self) -> bool:
        """Whether the session is still recorded; the end of the block says why it is not."""
        return not self._ended.done()

    def mark(self, text: str, **fields: Value) -> None:
        """Set a mark in the recording, with the time of this call.

        Args:
            text: What it says, up to 200 characters.
            fields: Up to 16 further values: texts, numbers, booleans or None.

        Raises:
            SettingError: A value is out of its limits, or too many marks wait.
            CohapticError: The recording has ended.
        """
        if self._ended.done():
            self._ended.result()
        assert self._loop is not None
        self._marks.put(self._loop.time(), text, fields)

    def begin(self) -> None:
        """Return when the session is recorded.

        Raises:
            CohapticError: It is not, and the error says why.
        """
        self._thread.start()
        self._begun.result()

    def end(self) -> None:
        """End the recording; return when all of it is in the file.

        Raises:
            CohapticError: The recording ended before; the file has what came until then.
        """
        self._ending.set()
        self._thread.join()
        self._ended.result()

    def _work(self) -> None:
        try:
            asyncio.run(self._record())
        except BaseException as error:  # for the thread of the script
            if self._begun.done():
                self._ended.set_exception(error)
            else:
                self._begun.set_exception(error)
        else:
            self._ended.set_result(None)

    async def _record(self) -> None:
        self._loop = asyncio.get_running_loop()
        async with opened(self._url, self._ca_file, SUBPROTOCOL, MAX_BYTES) as ws:
            await ws.send(encode_control(RecordRequest(token=self._token or None)))
            async with asyncio.timeout(_PATIENCE):
                first, *rest = decode_batch(await _next(ws))
            if not isinstance(first, SessionInfo):
                raise RemoteProtocolError("first entry", type(first).__name__, "SessionInfo")
            recorder = open_recorder(self._target, first, self._tell, "path")
            clock = ServerClock()
            pinging = asyncio.ensure_future(keep_time(ws, clock))
            sending = asyncio.ensure_future(self._send_marks(ws, clock))
            try:
                for entry in rest:
                    recorder.add(entry)
                self._begun.set_result(recorder)
                while not recorder.ended:
                    batch = decode_batch(await _next(ws))
                    for entry in batch:
                        recorder.add(entry)
                        if isinstance(entry, Ticked | PassedOver):
                            clock.heard(entry.t, self._loop.time())
            except _Over:
                pass
            finally:
                sending.cancel()
                pinging.cancel()
                asked, _ = await asyncio.gather(sending, pinging, return_exceptions=True)
                recorder.finish()
            if asked is not None:  # the end was not asked for: marks were still being sent
                raise ServerLost(self._url, "the server has ended the recording")

    async def _send_marks(self, ws: ClientConnection, clock: ServerClock) -> None:
        """Send marks, and at last that the recording ends."""
        assert self._loop is not None
        while len(self._marks) or not self._ending.is_set():
            if (mark := self._marks.due(self._loop.time(), clock.reading)) is not None:
                await ws.send(encode_control(mark))
            await asyncio.sleep(PACE)
        await ws.send(encode_control(EndRecording()))

    def _tell(self, sentence: str) -> None:
        """A full disk ends the recording, as `end` says; this thread has nobody to tell."""


class _Over(Exception):
    """The server has sent everything."""


async def _next(ws: ClientConnection) -> bytes:
    try:
        data = await ws.recv()
    except ConnectionClosed as closed:
        if closed.rcvd is not None and closed.rcvd.code in _ENDS:
            raise _Over from closed
        raise
    if isinstance(data, str):
        error = decode_error(data)
        raise Refused(error.code, error.message, error.field)
    return data


@contextlib.contextmanager
def record(
    path: str | Path, url: str, *, token: str = "", ca_file: str = "", insecure: bool = False
) -> Generator[RoomRecording]:
    """Record a room while the block runs; arguments and errors are those of `cohaptic.record`."""
    address = room_at(url, token, insecure=insecure)
    recording = RoomRecording(str(path), address.url, address.token, ca_file)
    recording.begin()
    try:
        yield recording
    except BaseException:
        with contextlib.suppress(CohapticError):  # the error of the block is the one to see
            recording.end()
        raise
    recording.end()
