"""A hand in a script: the state of a running client as attributes, and its samples and events.

All positions are in the world frame, in metres; `hand.body.to_file` and `hand.body.from_file` turn
them into those of the object's file and back.
"""

from __future__ import annotations

import asyncio
import logging
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from cohaptic.errors import CohapticError, ServerLost, SettingError
from cohaptic.protocol.messages import BodyInfo
from cohaptic.protocol.patch import Patch
from cohaptic.status.report import TouchStatus
from cohaptic.status.row import ROW, Row, columns_with, rows_in
from cohaptic.vec import Vec3, add, dot, norm, scale, sub
from cohaptic_client.client import RETRY, Client
from cohaptic_client.devices.scripted import SCRIPTED
from cohaptic_client.loop.added import reasons_of
from cohaptic_client.loop.passed import Passed
from cohaptic_client.network.conversation import Refused
from cohaptic_client.network.marks import Value
from cohaptic_client.network.watching import PASSING, Watcher
from cohaptic_client.news import News
from cohaptic_client.scripting.stream import Stream
from cohaptic_client.settings import ClientSettings

if TYPE_CHECKING:
    from cohaptic.recording.why import Why

log = logging.getLogger("cohaptic.hand")
# s of samples that may wait for a script: a pause of a debugger or a figure, in 25 MB.
_WAITING: Final = 60.0
_EVENTS: Final = 1000  # that may wait; a full room says a dozen when it comes together
_READY: Final = 0.01  # s between looks whether the loop has begun
# Share of the radius within which a straight way counts as near the middle: a body is no ball.
_INSIDE: Final = 0.9
_THROUGH: Final = (
    "the straight way of the tip passes near the middle of the body; where it goes through, the"
    " body pushes with all its force: lead the tip round by further points, or begin on the other"
    " side with tip="
)
_TROUBLE: Final = {"fault", "device", "server", "machine"}


class Other(NamedTuple):
    """Another user of the room.

    Fields:
        user: Number of the user.
        name: Name of the user.
        tip: Position of its tip, shape (3,) [m]; None while this client does not watch the room, or
            before the first scene.
        force: Force on its hand, shape (3,) [N]; None as for `tip`.
    """

    user: int
    name: str
    tip: Vec3 | None
    force: Vec3 | None


class LiveHand:
    """A hand in a room; [`join`][cohaptic_client.join] and `joined` make it.

    Every attribute is the newest value there is, and none waits; while the client comes back to a
    lost server, or to another object, that is the last one of before. After the hand was lost for
    good, they raise the error by which it was lost.

    Attributes:
        events: What has happened, as [`News`][cohaptic_client.News], for `for`, `async for` or
            `events.new()`.
    """

    def __init__(
        self, settings: ClientSettings, passed: Passed | None = None, *, watch: bool = True
    ) -> None:
        self.events: Stream[News, News] = Stream(_EVENTS, lambda news: [news], lambda news: 1)
        self._client = Client(settings, tell=self._tell, keep=self._keep, passed=passed)
        self._scripted = self._client.settings.device == SCRIPTED
        self._watcher = Watcher(self._client.settings, self._client.clock) if watch else None
        self._samples: Stream[bytes, Row] | None = None
        self._lost_rows = 0
        self._row: Row | None = None
        self._body: BodyInfo | None = None
        self._patch: Patch | None = None
        self._error: CohapticError | None = None
        self._ended = False
        self._warned = False

    async def run(self) -> None:
        """Touch until this call is cancelled or the hand is lost.

        Raises:
            CohapticError: An error of [`Client.run`][cohaptic_client.Client].
        """
        watching = asyncio.ensure_future(self._watch())
        try:
            await self._client.run()
        except CohapticError as error:
            self._error = error
            raise
        finally:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
            self._ended = True
            self.events.end()
            if self._samples is not None:
                self._samples.end()

    async def ready(self) -> None:
        """Return once the hand feels the object: its loop uses a patch."""
        while (row := self._client.row) is None or row.tick == 0.0:
            await asyncio.sleep(_READY)

    @property
    def name(self) -> str:
        """Name of this user."""
        return self._client.settings.name

    @property
    def user(self) -> int:
        """Number of this user in the room; 0 while the client comes back to it."""
        self._check()
        return self._client.user or 0

    @property
    def body(self) -> BodyInfo:
        """Body that the hand touches."""
        self._check()
        self._body = self._client.body or self._body
        assert self._body is not None  # the hand was ready
        return self._body

    @property
    def sample(self) -> Row:
        """Everything about the newest haptic period."""
        self._check()
        self._row = self._client.row or self._row
        assert self._row is not None
        return self._row

    @property
    def tip(self) -> Vec3:
        """Position of the tip, shape (3,) [m].

        Of a hand without a device a script may set it: the tip then moves there, at 0.5 m/s at
        most, and is there about 40 ms after the last of many small steps.
        """
        return self.sample.tip

    @tip.setter
    def tip(self, point: Vec3) -> None:
        self.move_to(point, 0.0)

    def move_to(self, point: Vec3, seconds: float) -> None:
        """Move the tip to a point on a straight line, without waiting until it is there.

        Args:
            point: Place, shape (3,) [m].
            seconds: Time for the way; it takes longer where that would be faster than 0.5 m/s [s].

        Raises:
            SettingError: A device moves this hand, or a value is not finite.
            ServerLost: The hand has left.
        """
        self._check()
        if self._ended:
            raise ServerLost(self._client.settings.url, "the hand has left: its block is over")
        if not self._scripted:
            device = self._client.settings.device.name
            raise SettingError("tip", f"moved by the device {device}", "moved by the script alone")
        x, y, z = (float(value) for value in point)  # of any sequence, such as an array
        if not all(map(math.isfinite, (x, y, z, seconds))) or seconds < 0.0:
            raise SettingError("tip", (x, y, z, seconds), "finite numbers, and a time from 0 s")
        self._warn_of_way((x, y, z))
        self._client.move_to((x, y, z), seconds)

    def _warn_of_way(self, end: Vec3) -> None:
        """Say once if a straight way from outside the body to outside may go through it."""
        row, body = self._client.row, self._client.body
        if row is None or body is None or self._warned:
            return
        center, begin = body.center, row.tip
        way = sub(end, begin)
        share = min(1.0, max(0.0, dot(sub(center, begin), way) / max(dot(way, way), 1e-12)))
        nearest = norm(sub(add(begin, scale(way, share)), center))
        ends = min(norm(sub(begin, center)), norm(sub(end, center)))
        if nearest < _INSIDE * body.radius and ends >= body.radius:
            self._warned = True  # a path of many small steps would say it at each
            self._tell(News("device", _THROUGH))

    @property
    def force(self) -> Vec3:
        """Force on the hand, shape (3,) [N]."""
        return self.sample.force

    @property
    def patch(self) -> Patch:
        """Newest patch: the surface in front of the hand, its stiffness `k_o` and the gains."""
        self._check()
        self._patch = self._client.patch or self._patch
        assert self._patch is not None
        return self._patch

    @property
    def others(self) -> tuple[Other, ...]:
        """The other users of the room, with tips and forces if this client watches the room."""
        self._check()
        scene = None if self._watcher is None else self._watcher.scene
        seen = {} if scene is None else {record.user: record for record in scene.users}
        return tuple(
            Other(user, name, seen[user].probe, seen[user].force)
            if user in seen
            else Other(user, name, None, None)
            for user, name in sorted(self._client.others.items())
        )

    @property
    def why(self) -> Why:
        """Why the force is as it is: what each rule did to it [N], and one sentence of all."""
        # Imported here, because it imports numpy, which few scripts need for this.
        import numpy as np

        from cohaptic.recording.why import why

        rules = reasons_of(self._client.settings.rules)
        row = self.sample
        columns = {
            name: np.array([value])
            for name, value in zip(columns_with(list(rules)), row, strict=True)
        }
        return replace(why(columns, 0.0, rules), t=row.t)

    @property
    def status(self) -> TouchStatus:
        """The state of this client as `cohaptic touch` shows it: link, loop and contact."""
        self._check()
        return self._client.status()

    def samples(self) -> Stream[bytes, Row]:
        """Return every haptic period from now on, for `for` or `async for`; each comes once.

        They come in bursts, ten times a second. A script that takes none for a minute loses the
        oldest, as `lost` of the stream then counts, and an event says.
        """
        if self._samples is None:
            limit = round(_WAITING * self._client.settings.loop_hz)
            self._samples = Stream(limit, rows_in, lambda block: len(block) // ROW.size)
            if self._ended:
                self._samples.end()
        return self._samples

    @property
    def recorded(self) -> bool:
        """Whether the server records the session, and this hand with it."""
        self._check()
        return self._client.recorded

    def mark(self, text: str, **fields: Value) -> None:
        """Set a mark in the recording of the session, with the time of this call.

        Args:
            text: What it says, up to 200 characters.
            fields: Up to 16 further values: texts, numbers, booleans or None.

        Raises:
            SettingError: Nothing records the session, or a value is out of its limits.
        """
        self._check()
        self._client.mark(text, fields)

    def acknowledge(self) -> None:
        """Acknowledge a fault: force may return once the hand has left the object."""
        self._check()
        self._client.acknowledge()

    def _check(self) -> None:
        """Raise the error by which the hand was lost."""
        if self._error is not None:
            raise self._error

    def _keep(self, rows: bytes) -> None:
        samples = self._samples
        if samples is None:
            return
        samples.put(rows)
        # Of the loop's memory and of the stream, which both keep the newest.
        lost = self._client.lost_rows + samples.lost
        if lost > self._lost_rows:
            self._tell(News("machine", f"{lost} samples are lost: nobody took them in time"))
            self._lost_rows = lost

    def _tell(self, news: News) -> None:
        log.log(logging.WARNING if news.kind in _TROUBLE else logging.INFO, "%s", news)
        self.events.put(news)

    async def _watch(self) -> None:
        """Watch the room once the hand is in it, and again after each loss; no more if refused."""
        if (watcher := self._watcher) is None:
            return
        await self.ready()
        said = ""
        while True:
            try:
                reason = await watcher.run(self._client.token)
            except Refused as refused:
                reason = str(refused)
                if refused.code not in PASSING:
                    self._tell(News("room", f"the tips of others are not seen: {reason}"))
                    return
            except CohapticError as error:
                reason = str(error)
            if reason != said:
                said = reason
                self._tell(News("room", f"the tips of others are not seen: {reason}"))
            await asyncio.sleep(2.0 * RETRY)
