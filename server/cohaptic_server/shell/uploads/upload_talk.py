"""The conversation with one visitor who brings a file, and with the worker that has it.

Each step waits for one of both, with a limit in time, and ends when the other one has gone.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from websockets.exceptions import ConnectionClosedError

from cohaptic.errors import CohapticError, RemoteProtocolError, one_line
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import (
    CHUNK,
    Examined,
    Progress,
    UploadRequest,
    decode_upload_request,
)
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.shell.wire import Wire
from cohaptic_server.upload.described import from_fields
from cohaptic_server.upload.pipe import DATA, PipeEnded, fields_of
from cohaptic_server.upload.process import UploadFailed, WorkerProcess

# Bytes a second. A piece then takes 4 ms, in which the tick comes to its turn.
_RATE = 8e6

T = TypeVar("T")


class ChoiceRefused(CohapticError):
    """The object cannot be made as the visitor chose.

    Args:
        about: Which choice, as in `Refused`.
        why: A sentence.
    """

    def __init__(self, about: str, why: str) -> None:
        super().__init__(about, why)
        self.about = about
        self.why = why

    def __str__(self) -> str:
        return self.why


class Caller:
    """Makes calls that may wait, in a thread, one at a time.

    Args:
        thread: That makes them.
    """

    def __init__(self, thread: ThreadPoolExecutor) -> None:
        self._thread = thread

    async def __call__(self, work: Callable[[], T]) -> T:
        """The result of some work."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)


async def next_request(ws: Wire, kind: type[T], patience: float) -> T:
    """The next message, which has to be of this kind."""
    async with asyncio.timeout(patience):
        data = await ws.recv()
    ws.taken()
    message: UploadRequest | None = None
    if isinstance(data, str):
        message = decode_upload_request(data)
    if not isinstance(message, kind):
        said = "bytes" if message is None else type(message).__name__
        raise RemoteProtocolError("message", said, kind.__name__)
    return message


async def pass_on(ws: Wire, size: int, worker: WorkerProcess, call: Caller) -> None:
    """Pass the pieces of the file on to the worker, as they come and no faster than `_RATE`."""
    come = 0
    while come < size:
        piece = await ws.recv()
        ws.taken()
        if isinstance(piece, str) or not piece:
            raise RemoteProtocolError("piece of the file", "none", f"1 to {CHUNK:,} bytes")
        come += len(piece)
        if come > size:
            raise RemoteProtocolError("file", f"{come:,} bytes or more", f"{size:,}, as was said")
        await call(partial(worker.send_piece, piece))
        await asyncio.sleep(len(piece) / _RATE)
    await call(lambda: worker.send_piece(b""))


async def follow(
    ws: Wire, worker: WorkerProcess, call: Caller, patience: float, doing: str
) -> ObjectFile | None:
    """Tell the visitor what the worker says, until it is done with a step; the object, if any.

    Raises:
        ChoiceRefused: It cannot be made as it was chosen.
        UploadFailed: It cannot be made.
    """
    try:
        async with asyncio.timeout(patience):
            while True:
                kind, data = await _unless_gone(ws, call(worker.receive))
                if kind == DATA:
                    await ws.send(data)
                    return None
                fields = fields_of(data)
                if fields.get("event") == "failed":
                    raise UploadFailed(one_line(str(fields.get("why")), 1600))
                if fields.get("event") == "refused":
                    raise ChoiceRefused(str(fields["about"]), one_line(str(fields["why"]), 1600))
                if fields.get("event") == "prepared":
                    return from_fields(dict(fields["source"]))
                await ws.send(_told(fields))
    except TimeoutError as error:
        words = f"{doing} takes longer than {patience:g} s, the limit of an upload"
        raise UploadFailed(words) from error
    except (PipeEnded, KeyError, TypeError, ValueError) as error:
        words = "what reads it says nothing that can be understood"
        raise UploadFailed(words) from error


def _told(fields: dict[str, Any]) -> str:
    """A message for the visitor of what the worker says, checked like a stranger's."""
    if fields.get("event") == "examined":
        return encode_control(Examined.model_validate_json(str(fields["message"])))
    return encode_control(Progress(phase=str(fields["phase"]), share=float(fields["share"])))


async def _unless_gone(ws: Wire, work: Awaitable[T]) -> T:
    """The result of some work; raises ConnectionClosed as soon as the visitor has gone."""
    task, gone = asyncio.ensure_future(work), asyncio.ensure_future(ws.wait_closed())
    try:
        await asyncio.wait((task, gone), return_when=asyncio.FIRST_COMPLETED)
        if not task.done():
            raise ConnectionClosedError(None, None)
        return task.result()
    finally:
        gone.cancel()
        # It ends with the worker, and its error is nobody's any more.
        task.add_done_callback(lambda done: done.cancelled() or done.exception())
