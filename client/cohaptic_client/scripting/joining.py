"""Joins a room from a script: for `async with`, and for `with` in a thread of its own."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import AsyncGenerator, Generator, Sequence
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

from cohaptic.control.law import DEFAULT_LAW, Law
from cohaptic.errors import ServerLost, SettingError
from cohaptic.protocol.messages import GeometryName
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.networks import read_network
from cohaptic.vec import Vec3
from cohaptic_client.address import read_address
from cohaptic_client.devices.catalogue import read_device
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.devices.scripted import SCRIPTED
from cohaptic_client.loop.added import RuleChoice
from cohaptic_client.loop.passed import pass_on
from cohaptic_client.scripting.live_hand import LiveHand
from cohaptic_client.settings import ClientSettings

# s for which a script waits for a server that has only just been started.
PATIENCE = 10.0


# Above 60 lines: every option of a hand is an argument, with its line of documentation.
@contextlib.asynccontextmanager
async def join(
    url: str,
    *,
    name: str = "hand",
    device: object = None,
    law: Law | str = DEFAULT_LAW,
    geometry: GeometryName = "plane",
    friction: float = 0.0,
    max_force: float = 10.0,
    rules: Sequence[RuleChoice] = (),
    tip: Vec3 | None = None,
    network: str | LinkSettings = "",
    token: str = "",
    watch: bool = True,
    settings: ClientSettings | None = None,
) -> AsyncGenerator[LiveHand, None]:
    """Touch the object of a server: `async with join(url, name="ann") as hand:`.

    The block begins when the hand feels the object. At its end the force fades to zero, and the
    hand leaves. The haptic loop has a process of its own, which no work of the script holds up.

    Args:
        url: Address of the server, or the link of an invitation, such as
            `https://lab.example/#token=...`.
        name: Name of the user, which the others see.
        device: None for a tip that the script moves; a text as after `cohaptic touch --device`; or
            any object with `read(now) -> DeviceSample` and `write(force)`, or a class or function
            that makes one in the loop's process.
        law: Local model that computes the force.
        geometry: Geometry of the local surface.
        friction: Coefficient of friction mu of the contact; 0 for none.
        max_force: Largest force on the hand [N].
        rules: Rules of your own in the loop, up to four, in the order in which they act: objects
            of [`AddedRule`][cohaptic_client.AddedRule], or names of entry points.
        tip: Where a tip that the script moves is at first; None for the right of the body [m].
        network: Injected network, in words as after `--network`, or as a link for both ways.
        token: Token of an invitation, if the link has none.
        watch: Whether a second connection watches the room, so that the others have tips.
        settings: Further settings of the client; their fields that are arguments here do not count.

    Raises:
        CohapticError: As `cohaptic touch` says it: no server, a refusal, a device that cannot be
            opened, a value outside its limits. An error that comes while the block runs is raised
            by the hand's attributes, and at the end of the block.
    """
    choice, own = _device(device)
    passed = pass_on(own, rules)
    address = read_address(url)
    link = read_network(network) if isinstance(network, str) else network
    more = settings or ClientSettings(address.url, name, patience=PATIENCE)
    hand = LiveHand(
        replace(
            more,
            url=address.url,
            name=name,
            device=choice,
            law=_law(law),
            geometry=geometry,
            friction=friction,
            max_force=max_force,
            rules=tuple(rules),
            up=replace(link, seed=2 * link.seed),
            down=replace(link, seed=2 * link.seed + 1),
            token=address.token or token or more.token,
        ),
        passed,
        watch=watch,
    )
    if tip is not None:
        hand.move_to(tip, 0.0)
    going = asyncio.ensure_future(hand.run())
    ready = asyncio.ensure_future(hand.ready())
    try:
        await asyncio.wait((going, ready), return_when=asyncio.FIRST_COMPLETED)
        if going.done():
            going.result()
            raise ServerLost(address.url, "its duration was over before the hand felt the object")
        yield hand
        if going.done():
            going.result()
    finally:
        for task in (ready, going):
            task.cancel()
        await asyncio.gather(ready, going, return_exceptions=True)


@contextlib.contextmanager
def joined(url: str, **options: Any) -> Generator[LiveHand, None, None]:
    """Touch the object of a server from a plain script: `with joined(url, name="ann") as hand:`.

    The same as [`join`][cohaptic_client.join], with the same arguments; the network runs in a
    thread of its own.
    """
    ready: Future[tuple[LiveHand, asyncio.AbstractEventLoop, asyncio.Event]] = Future()
    ended: Future[None] = Future()

    async def touch() -> None:
        end = asyncio.Event()
        async with join(url, **options) as hand:
            ready.set_result((hand, asyncio.get_running_loop(), end))
            await end.wait()

    def work() -> None:
        try:
            asyncio.run(touch())
        except BaseException as error:  # for the script's own thread
            (ended if ready.done() else ready).set_exception(error)
        else:
            ended.set_result(None)

    thread = threading.Thread(target=work, name="cohaptic hand", daemon=True)
    thread.start()
    hand, loop, end = ready.result()
    try:
        yield hand
    finally:
        loop.call_soon_threadsafe(end.set)
        thread.join()
    ended.result()


def _law(law: Law | str) -> Law:
    try:
        return Law(law)
    except ValueError:
        known = ", ".join(other.value for other in Law)
        raise SettingError("law", repr(law), f"one of: {known}") from None


def _device(device: object) -> tuple[DeviceChoice, object]:
    """Return the choice of a device that a script gives, and the object if it is one."""
    if device is None:
        return SCRIPTED, None
    if isinstance(device, str):
        return read_device(device), None
    if isinstance(device, DeviceChoice):
        return device, None
    return SCRIPTED, device  # the client replaces the choice by that of the object
