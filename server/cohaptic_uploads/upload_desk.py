"""Serves the connections that bring a mesh file: one upload at a time, in a worker process.

A separate thread makes the calls that may block, so that the thread of the tick never blocks. Each
step of the conversation waits either for the visitor or for the worker, with a time-out. A step
that waits for the worker ends when the visitor leaves, and the worker is then killed.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
import shlex
from collections.abc import AsyncGenerator, Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from websockets.exceptions import ConnectionClosed, ConnectionClosedError

from cohaptic.clock import SystemClock
from cohaptic.errors import (
    CloseCode,
    CohapticError,
    ProtocolError,
    RemoteProtocolError,
    SettingError,
    one_line,
)
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import (
    CHUNK,
    MAX_UPLOAD_TEXT,
    SUBPROTOCOL,
    BeginUpload,
    Examined,
    Prepared,
    PrepareObject,
    Progress,
    Refused,
    UploadOffer,
    UploadRequest,
    decode_upload_request,
)
from cohaptic_server.bodies.body import Body
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.objects.cost import Demand
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.cache import cache_folder
from cohaptic_server.routes import Route, Serving
from cohaptic_server.shell.endpoint import Endpoint
from cohaptic_server.shell.refusal import refuse
from cohaptic_server.shell.wire import Wire
from cohaptic_server.touchable import KINDS, kind_of
from cohaptic_uploads.described import from_fields
from cohaptic_uploads.limits import UploadLimits, in_words
from cohaptic_uploads.pipe import DATA, PipeEnded, fields_of
from cohaptic_uploads.process import Rubber, UploadFailed, WorkerProcess
from cohaptic_uploads.work_folder import remove_abandoned

# Largest rate of an upload [bytes/s]. A piece of the file then takes 4 ms, so that ticks run
# between pieces.
_RATE = 8e6

T = TypeVar("T")


class ChoiceRefused(CohapticError):
    """Error: the object cannot be made with the visitor's choice.

    Args:
        about: Choice that does not fit, as in `Refused`.
        why: Reason, as a sentence.
    """

    def __init__(self, about: str, why: str) -> None:
        super().__init__(about, why)
        self.about = about
        self.why = why

    def __str__(self) -> str:
        return self.why


class Caller:
    """Makes calls that may block, one at a time, in another thread."""

    def __init__(self, thread: ThreadPoolExecutor) -> None:
        self._thread = thread

    async def __call__(self, work: Callable[[], T]) -> T:
        """Run a function in the thread and return its result."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)


async def next_request(ws: Wire, kind: type[T], patience: float) -> T:
    """Receive the next message, which has to be of this kind.

    Raises:
        RemoteProtocolError: The message is of another kind.
        TimeoutError: No message came within `patience` [s].
    """
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
    """Pass the pieces of the file on to the worker as they come, at a rate of at most `_RATE`."""
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
    """Pass messages of the worker on to the visitor until the worker has finished a step.

    Returns:
        The prepared object; None if the finished step was the preview of the file.

    Raises:
        ChoiceRefused: The object cannot be made with the visitor's choice.
        UploadFailed: The object cannot be made, or not within `patience` [s].
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
                await ws.send(_report(fields))
    except TimeoutError as error:
        words = f"{doing} takes longer than {patience:g} s, the limit of an upload"
        raise UploadFailed(words) from error
    except (PipeEnded, KeyError, TypeError, ValueError) as error:
        words = "what reads it says nothing that can be understood"
        raise UploadFailed(words) from error


def _report(fields: dict[str, Any]) -> str:
    """Check a message of the worker as strictly as a stranger's; returns it for the visitor."""
    if fields.get("event") == "examined":
        return encode_control(Examined.model_validate_json(str(fields["message"])))
    return encode_control(Progress(phase=str(fields["phase"]), share=float(fields["share"])))


async def _unless_gone(ws: Wire, work: Awaitable[T]) -> T:
    """Wait for the result of `work`; raises ConnectionClosed as soon as the visitor has left."""
    task, gone = asyncio.ensure_future(work), asyncio.ensure_future(ws.wait_closed())
    try:
        await asyncio.wait((task, gone), return_when=asyncio.FIRST_COMPLETED)
        if not task.done():
            raise ConnectionClosedError(None, None)
        return task.result()
    finally:
        gone.cancel()
        # An unfinished task ends with the worker; its error is read so that asyncio logs none.
        task.add_done_callback(lambda done: done.cancelled() or done.exception())


log = logging.getLogger("cohaptic.server")

_MAX_WAITING = 8  # open upload connections, whether their upload runs or not
_GREETING = 10.0  # s for the first message
Open = Callable[[ObjectFile], Awaitable[None]]


class UploadDesk:
    """Serves all connections of visitors who bring files.

    Args:
        open_object: Makes a prepared object the object of the server.
        limits: Limits of one upload; None takes the defaults.
        rubber: Parameters for making nonlinear solids from the files; None makes linear solids.

    Attributes:
        worker: Worker of the running upload; None without one.
        busy: Whether an upload is running.
    """

    def __init__(
        self,
        open_object: Open,
        limits: UploadLimits | None = None,
        rubber: Rubber | None = None,
    ) -> None:
        self.limits = limits or UploadLimits()
        self.worker: WorkerProcess | None = None
        self._open_object = open_object
        self._rubber = rubber
        self._clock = SystemClock()
        self.busy = False
        self._connections = 0

    @property
    def endpoint(self) -> Endpoint:
        """Kind of connection that the desk serves, for `CohapticServer.add_endpoint`."""
        return Endpoint(
            self.serve, max(CHUNK, MAX_UPLOAD_TEXT), as_fast_as_served=True, leaving=None
        )

    async def serve(self, ws: Wire) -> None:
        """Serve one connection to its end; the visitor gets one sentence about any error."""
        self._connections += 1
        try:
            if self._connections > _MAX_WAITING:
                limit = f"at most {_MAX_WAITING}"
                raise RemoteProtocolError("uploads", "too many", limit, CloseCode.ROOM_FULL)
            await self._serve(ws)
            await ws.close(1000)
        except ProtocolError as error:
            await refuse(ws, error.code, str(error))
        except TimeoutError:
            await refuse(ws, CloseCode.UPLOAD_FAILED, "the time of this upload is over")
        except OSError as error:
            log.warning("no upload can be read: %s", one_line(str(error), 200))
            why = "this server cannot start what reads files; try again in a minute"
            await refuse(ws, CloseCode.UPLOAD_FAILED, why)
        except CohapticError as error:
            log.info("an upload came to nothing: %s", one_line(str(error), 200))
            await refuse(ws, CloseCode.UPLOAD_FAILED, str(error))
        except ConnectionClosed:
            pass
        finally:
            self._connections -= 1

    async def _serve(self, ws: Wire) -> None:
        limits = self.limits
        offer = UploadOffer(
            kinds=KINDS,
            max_bytes=limits.file,
            max_memory=limits.memory,
            max_seconds=limits.prepare,
        )
        await ws.send(encode_control(offer))
        begin = await next_request(ws, BeginUpload, _GREETING)
        if kind_of(begin.name) not in KINDS:
            kind = kind_of(begin.name) or "(none)"
            raise UploadFailed(
                f"files of kind {kind[:16]} are not read; these are: {' '.join(KINDS)}"
            )
        if begin.size > limits.file:
            raise UploadFailed(
                f"the file has {begin.size / 2**20:,.1f} MiB; the limit is"
                f" {limits.file / 2**20:g} MiB. Simplify it first"
            )
        if self.busy:
            raise UploadFailed("another object is being prepared here; try again in a minute")
        self.busy = True
        try:
            async with self._working(begin.name) as call:
                await self._converse(ws, begin, call)
        finally:
            self.busy = False

    @contextlib.asynccontextmanager
    async def _working(self, name: str) -> AsyncGenerator[Caller]:
        """Start a worker, and end it after the block, also after an error."""
        thread = ThreadPoolExecutor(1, "upload")
        call = Caller(thread)

        def start() -> None:
            self.worker = WorkerProcess(self.limits, name, self._rubber)

        def end() -> None:
            worker, self.worker = self.worker, None
            if worker is not None:
                worker.close()

        try:
            await call(start)
            yield call
        finally:
            if self.worker is not None:
                self.worker.kill()  # a call that waits for the worker returns now
            # In the same thread, so that a worker that is still starting is ended, too.
            await asyncio.shield(call(end))
            thread.shutdown(wait=False)

    async def _converse(self, ws: Wire, begin: BeginUpload, call: Caller) -> None:
        limits, worker = self.limits, self.worker
        assert worker is not None
        try:
            async with asyncio.timeout(limits.receive):
                await pass_on(ws, begin.size, worker, call)
        except TimeoutError as error:
            words = f"the file did not come within {limits.receive:g} s"
            raise UploadFailed(words) from error
        await follow(ws, worker, call, limits.examine, "reading it")
        source = await self._choose(ws, worker, call)
        await ws.send(encode_control(Progress(phase="opening", share=0.0)))
        name = re.split(r"[\\/]", begin.name)[-1]
        try:
            await self._open_object(source)
        except CohapticError as error:
            reported = str(error).replace(str(source.path), name)
            raise UploadFailed(reported.replace(str(cache_folder()), "the store")) from error

        def command(path: str) -> str:
            more = ["--nonlinear"] if self._rubber is not None else []
            return shlex.join(["cohaptic", "serve", "--body", path, *source.to_arguments(), *more])

        log.info("to serve the object again: %s", command(str(source.path)))
        # The visitor gets the name of the visitor's own file, and no path of this machine.
        await ws.send(encode_control(Prepared(command=command(name))))

    async def _choose(self, ws: Wire, worker: WorkerProcess, call: Caller) -> ObjectFile:
        """Prepare the object as the visitor chooses; the visitor may change a refused choice."""
        limits = self.limits
        patience = limits.decide
        for left in reversed(range(limits.tries)):
            asked = self._clock.now()
            wish = await next_request(ws, PrepareObject, patience)
            patience = max(0.0, patience - (self._clock.now() - asked))
            fields: dict[str, Any] = wish.model_dump(exclude={"type"})
            await call(partial(worker.send_wish, **fields))
            try:
                source = await follow(ws, worker, call, limits.prepare, "preparing it")
            except ChoiceRefused as refused:
                if not left:
                    raise
                reported = {"about": refused.about, "message": refused.why, "tries": left}
                await ws.send(encode_control(Refused.model_validate(reported)))
                continue
            if source is not None:
                return source
            break
        raise UploadFailed("what reads it says nothing that can be understood")


def take_uploads(serving: Serving) -> UploadDesk:
    """Let visitors bring objects to a server; a nonlinear object gets a mesh that a tick can solve.

    Raises:
        SettingError: The server's settings do not allow uploads, and the server refuses them.
    """
    if not serving.server.settings.allow_upload:
        raise SettingError("allow_upload", False, "true for a server that takes files")
    remove_abandoned()
    server, damping, nonlinear = serving.server, serving.damping, serving.nonlinear
    period = server.settings.simulation_period
    demand = Demand(hz=server.settings.simulation_hz, nonlinear=nonlinear)

    async def open_object(source: ObjectFile) -> None:
        def made() -> Body:
            # The slow parts are in the store already; a separate process solves with the factor.
            return build_body(
                str(source.path), source, nonlinear=nonlinear, damping=damping, demand=demand,
                late=True,
            )  # fmt: skip

        await server.exchange(made, serving.served.use)

    desk = UploadDesk(open_object, rubber=Rubber(period, damping) if nonlinear else None)
    server.add_endpoint(SUBPROTOCOL, desk.endpoint)
    return desk


@contextlib.asynccontextmanager
async def _open(serving: Serving, _text: str) -> AsyncGenerator[str]:
    yield in_words(take_uploads(serving).limits)


ROUTE = Route(_open)
