"""A thread that watches a room, shows each new scene at a bounded rate, and says what happens."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import Final, NamedTuple

from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError, ServerLost, ServerUnreachable, one_line
from cohaptic.protocol.scene_users import SceneUsers
from cohaptic.vec import Vec3
from cohaptic_client.client import RETRY
from cohaptic_client.network.conversation import Refused
from cohaptic_client.network.watching import PASSING, Watcher
from cohaptic_client.settings import ClientSettings

_LONGEST: Final = 400  # characters of a sentence about an end
_FIRST: Final = 10.0  # s for the first answer; a server on the same machine takes 20 ms


class Seen(NamedTuple):
    """What a scene says of the users.

    Fields:
        tick: Number of the server's tick.
        tips: Position of the tip of each user, by name, shape (3,) [m].
        forces: Force on the hand of each user, by name, shape (3,) [N].
    """

    tick: int
    tips: dict[str, Vec3]
    forces: dict[str, Vec3]


def seen_in(scene: SceneUsers, names: Mapping[int, str]) -> Seen:
    """Return tips and forces by name, without those of users who have left.

    Args:
        names: Names of the users in the room, by number.
    """
    there = [(names[record.user], record) for record in scene.users if record.user in names]
    return Seen(
        scene.tick,
        {name: record.probe for name, record in there},
        {name: record.force for name, record in there},
    )


class WatchedRoom:
    """Watches a room in a thread of its own until it is closed or refused for good.

    Args:
        settings: Settings with the address of the server and the token.
        rate: Largest number of calls of `show` [1/s].
        show: Function that is called in the thread with each new scene that there is time for, and
            without users when the connection is lost.
        say: Function that is called in the thread with a sentence about what happens.

    Attributes:
        token: Token for further connections: of the session, once the server has begun one.
    """

    def __init__(
        self,
        settings: ClientSettings,
        rate: float,
        show: Callable[[Seen], None],
        say: Callable[[str], None],
    ) -> None:
        self.token = settings.token
        self._settings, self._rate = settings, rate
        self._show, self._say = show, say
        self._begun: Future[None] = Future()
        self._loop = asyncio.new_event_loop()
        self._end = asyncio.Event()
        self._thread = threading.Thread(target=self._work, name="cohaptic view", daemon=True)

    def open(self) -> None:
        """Begin to watch; return once the server lets this client watch.

        Raises:
            CohapticError: No server answers, or it refuses.
        """
        self._thread.start()
        try:
            self._begun.result(_FIRST)
        except TimeoutError:
            self.close()
            problem = f"it does not answer within {_FIRST:g} s; is it a server of cohaptic?"
            raise ServerLost(self._settings.url, problem) from None
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop watching; return when the thread has ended, unless it is the one that calls."""
        with contextlib.suppress(RuntimeError):  # it has ended by itself
            self._loop.call_soon_threadsafe(self._end.set)
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _work(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            try:
                runner.run(self._run())
                self._say("closed")
            except Exception as error:
                if not self._begun.done():
                    self._begun.set_exception(error)
                    return
                why = str(error) if isinstance(error, CohapticError) else repr(error)
                self._say(f"ended: {one_line(why, _LONGEST)}")
                if not isinstance(error, CohapticError):
                    raise  # from a function of the notebook, whose author needs the traceback

    async def _run(self) -> None:
        watcher = Watcher(self._settings, SystemClock())
        parts = [self._stay(watcher), self._look(watcher), self._end.wait()]
        tasks = [asyncio.ensure_future(part) for part in parts]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _stay(self, watcher: Watcher) -> None:
        """Watch, and come back to a lost server; raise what ends the view for good."""
        while True:
            try:
                reason = await watcher.run(self.token, self._rate)
                if not self._begun.done():
                    raise ServerLost(self._settings.url, reason)
            except CohapticError as error:
                refused = isinstance(error, Refused) and error.code not in PASSING
                if refused or isinstance(error, ServerUnreachable) or not self._begun.done():
                    raise
                reason = str(error)
            self._say(f"not connected: {one_line(reason, _LONGEST)}; trying again")
            await asyncio.sleep(2.0 * RETRY)

    async def _look(self, watcher: Watcher) -> None:
        """Show the newest scene, and no other, whenever it is time for the next."""
        met, shown, tick = watcher.watching, watcher.scene, 0
        while True:
            if (watching := watcher.watching) is not met:
                met = watching
                if watching is not None:
                    self.token = watching.session or self.token
                    self._say(f"watching {watching.body.name}")
                    if not self._begun.done():
                        self._begun.set_result(None)
            if (scene := watcher.scene) is not shown:
                shown = scene
                tick = tick if scene is None else scene.tick
                self._show(Seen(tick, {}, {}) if scene is None else seen_in(scene, watcher.names))
            await asyncio.sleep(1.0 / self._rate)
