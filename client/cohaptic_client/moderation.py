"""Performs an administrator's action in a room, over a connection that also watches the room."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import AsyncGenerator
from typing import TypeVar
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidURI
from websockets.typing import Subprotocol

from cohaptic.errors import ServerLost, SettingError
from cohaptic.protocol.messages import Error, RoomUser, encode_control
from cohaptic.protocol.rest_mesh import MAX_BYTES
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import (
    Moderate,
    Moderated,
    PutOut,
    Watch,
    Watching,
    decode_watch_control,
)
from cohaptic_client.address import proxy_for, silence, trust, why_not_trusted, with_slash
from cohaptic_client.admin_action import Action
from cohaptic_client.network.conversation import Refused

_NOT_BEGUN = "it is recorded already, or the server could not begin: its log says why"
_PATIENCE = 15.0  # s for connection and answers; a server answers within 1 s
M = TypeVar("M", Watching, Moderated, PutOut)


async def act(
    url: str, token: str, ca_file: str, action: Action, who: str, force: float | None
) -> list[str]:
    """Connect to a room and perform an administrator's action; return lines to show.

    Args:
        url: Address of the room.
        token: Token of the administrator; empty for none.
        ca_file: File with the certificates to trust; empty for the system's certificates.
        who: Name or number of the user concerned; empty if the action concerns no single user.
        force: Largest force of all users together, for the action `force-budget` [N]; None for no
            limit.

    Raises:
        ServerLost: No cohaptic server answers.
        Refused: The server refuses the connection or the action.
        SettingError: The user is not in the room, or, for unban, was not kicked or banned.
    """
    async with opened(url, ca_file) as ws, asyncio.timeout(_PATIENCE):
        return await _talk(ws, token, action, who, force)


@contextlib.asynccontextmanager
async def opened(
    url: str, ca_file: str, subprotocol: str = SUBPROTOCOL, longest: int = MAX_BYTES
) -> AsyncGenerator[ClientConnection]:
    """Connect to a room; errors of the connection inside the block are those of `act`.

    Args:
        url: Address of the room.
        ca_file: File with the certificates to trust; empty for the system's certificates.
        subprotocol: Kind of the connection.
        longest: Largest message that may come [bytes].
    """
    try:
        async with connect(
            with_slash(url),
            subprotocols=[Subprotocol(subprotocol)],
            compression=None,
            proxy=proxy_for(url),
            max_size=longest,
            ssl=trust(url, ca_file),
            open_timeout=_PATIENCE,
        ) as ws:
            yield ws
    except ssl.SSLError as error:
        raise ServerLost(url, why_not_trusted(error, urlsplit(url).hostname or "")) from error
    except ConnectionClosed as error:
        frame = error.rcvd
        if frame is None:
            raise ServerLost(url, "the connection was lost") from error
        raise Refused(frame.code, frame.reason) from error
    except (InvalidHandshake, InvalidURI, ValueError) as error:
        raise ServerLost(url, f"not a cohaptic server ({error})") from error
    except (OSError, TimeoutError) as error:
        raise ServerLost(url, silence(proxy_for(url))) from error


async def _talk(
    ws: ClientConnection, token: str, action: Action, who: str, force: float | None
) -> list[str]:
    await ws.send(watch_text(token))
    watching = await _answer(ws, Watching)
    if action is Action.LIST:
        there = [f"{user.user}  {user.name}" for user in watching.users] or ["nobody touches"]
        if not watching.room_admin:
            return there
        return there + [f"put out: {name}" for name in (await _answer(ws, PutOut)).names]
    if action is Action.UNBAN:
        return [await _unban(ws, who)]
    user = _find(watching.users, who) if who else None
    name = action.value.replace("-", "_")
    wish = Moderate.model_validate({"action": name, "user": user and user.user, "force": force})
    await ws.send(encode_control(wish))
    if not (await _answer(ws, Moderated)).done:
        if action in (Action.RECORD, Action.END_RECORDING):
            return ["nothing is recorded" if action is Action.END_RECORDING else _NOT_BEGUN]
        return [f"{who} has left"]
    return [f"done: {action.value}{f' {user.name}' if user else ''}"]


def watch_text(token: str, rate: float = 1.0) -> str:
    """Return the first message of a connection that needs few scenes a second, or none."""
    watch = Watch(protocol=PROTOCOL_VERSION, encoding="forces", rate=rate, token=token or None)
    return encode_control(watch)


async def _unban(ws: ClientConnection, who: str) -> str:
    """Let a user who was kicked or banned come back; return a line to show."""
    names = (await _answer(ws, PutOut)).names
    if who not in names:
        limit = f"one who was put out: {', '.join(names) or 'nobody was'}"
        raise SettingError("user", repr(who[:60]), limit)
    await ws.send(encode_control(Moderate(action="unban", name=who)))
    done = (await _answer(ws, Moderated)).done
    return f"done: unban {who}" if done else f"{who} may come back already"


def _find(users: tuple[RoomUser, ...], who: str) -> RoomUser:
    # Numbers first, because the server gives them, and a user may have chosen a number as a name.
    for user in users:
        if who == str(user.user):
            return user
    for user in users:
        if who == user.name:
            return user
    names = ", ".join(f"{user.user} {user.name}" for user in users) or "nobody touches"
    raise SettingError("user", repr(who[:60]), f"one of: {names}")


async def _answer(ws: ClientConnection, kind: type[M]) -> M:
    """Return the next message of type `kind`; raise Refused if the server sends an error first."""
    while True:
        data = await ws.recv()
        if isinstance(data, bytes):
            continue  # the mesh, and scenes
        message = decode_watch_control(data)
        if isinstance(message, kind):
            return message
        if isinstance(message, Error):
            raise Refused(message.code, message.message, message.field)
