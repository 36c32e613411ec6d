"""Connections that bring a mesh file: one upload at a time, in a worker process of its own.

The conversation waits for the visitor and for the worker, and never for both at once. A thread
makes the calls that may wait, so that the tick's does not; if the visitor goes, the worker ends.
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
from typing import Any

from websockets.exceptions import ConnectionClosed

from cohaptic.clock import SystemClock
from cohaptic.errors import CloseCode, CohapticError, ProtocolError, RemoteProtocolError, one_line
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import (
    BeginUpload,
    Prepared,
    PrepareObject,
    Progress,
    Refused,
    UploadOffer,
)
from cohaptic_server.bodies.body import Body
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.objects.demand import Demand
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.cache import cache_folder
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.refusal import refuse
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.shell.uploads.upload_talk import (
    Caller,
    ChoiceRefused,
    follow,
    next_request,
    pass_on,
)
from cohaptic_server.shell.wire import Wire
from cohaptic_server.touchable import KINDS, kind_of
from cohaptic_server.upload.limits import UploadLimits
from cohaptic_server.upload.process import Rubber, UploadFailed, WorkerProcess
from cohaptic_server.upload.work_folder import remove_abandoned

log = logging.getLogger("cohaptic.server")

_MAX_WAITING = 8  # connections that have not begun, or wait for their close
_GREETING = 10.0  # s for the first message
Open = Callable[[ObjectFile], Awaitable[None]]


class UploadDesk:
    """Takes files from visitors.

    Args:
        open_object: Makes a prepared object that of the server.
        limits: Of one upload.
        rubber: What makes nonlinear solids of the files; None makes linear ones.

    Attributes:
        worker: Of the upload that runs; None without one.
        busy: Whether there is one.
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

    async def serve(self, ws: Wire) -> None:
        """Serve one connection to its end; whatever goes wrong is one sentence to it alone."""
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
        """A worker, and its end whatever happens."""
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
                self.worker.kill()  # a call that waits for it returns now
            # In the same thread, so that one whose start is no longer waited for ends as well.
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
            told = str(error).replace(str(source.path), name)
            raise UploadFailed(told.replace(str(cache_folder()), "the store")) from error

        def command(path: str) -> str:
            more = ["--nonlinear"] if self._rubber is not None else []
            return shlex.join(["cohaptic", "serve", "--body", path, *source.to_arguments(), *more])

        log.info("to serve the object again: %s", command(str(source.path)))
        # No path of this machine is told; the visitor has the file by its own name.
        await ws.send(encode_control(Prepared(command=command(name))))

    async def _choose(self, ws: Wire, worker: WorkerProcess, call: Caller) -> ObjectFile:
        """Prepare the object as the visitor wishes; one who wished for what cannot be may again."""
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
                told = {"about": refused.about, "message": refused.why, "tries": left}
                await ws.send(encode_control(Refused.model_validate(told)))
                continue
            if source is not None:
                return source
            break
        raise UploadFailed("what reads it says nothing that can be understood")


def take_uploads(
    server: CohapticServer, served: ServedBody, damping: float, *, nonlinear: bool = False
) -> UploadDesk:
    """Let visitors bring objects to a server.

    Args:
        server: Of the object.
        served: Its body.
        damping: B_o over K_o of every object.
        nonlinear: Whether they are nonlinear solids, on meshes as fine as the tick affords.
    """
    remove_abandoned()
    period = server.settings.simulation_period
    demand = Demand(hz=server.settings.simulation_hz, nonlinear=nonlinear)

    async def open_object(source: ObjectFile) -> None:
        def made() -> Body:
            # What takes long is in the store; a process of its own solves with the factor.
            return build_body(
                str(source.path), source, nonlinear=nonlinear, damping=damping, demand=demand,
                late=True,
            )  # fmt: skip

        await server.exchange(made, served.use)

    desk = UploadDesk(open_object, rubber=Rubber(period, damping) if nonlinear else None)
    server.take_upload = desk.serve
    return desk
