"""`cohaptic admin`: who is in a room, and what its administrator does."""

from __future__ import annotations

import asyncio
import ssl
from enum import Enum
from pathlib import Path
from typing import Annotated, TypeVar
from urllib.parse import urlsplit

import typer
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidURI
from websockets.typing import Subprotocol

from cohaptic.errors import ServerLost, SettingError, one_line
from cohaptic.protocol.messages import Error, encode_control
from cohaptic.protocol.rest_mesh import MAX_BYTES
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import (
    Moderate,
    Moderated,
    PutOut,
    Watch,
    WatchedUser,
    Watching,
    decode_watch_control,
)
from cohaptic.room_address import room_url
from cohaptic_client.address import check_secrecy, read_address, trust, why_not_trusted
from cohaptic_client.network.conversation import Refused

_PATIENCE = 15.0  # s for an answer, which comes within one
M = TypeVar("M", Watching, Moderated, PutOut)


class Action(Enum):
    """What is done, as the command line names it."""

    LIST = "list"
    MUTE = "mute"
    UNMUTE = "unmute"
    KICK = "kick"
    BAN = "ban"
    UNBAN = "unban"
    FREEZE = "freeze"
    UNFREEZE = "unfreeze"
    RESET = "reset"
    BUDGET = "force-budget"


_TO_SOMEBODY = (Action.MUTE, Action.UNMUTE, Action.KICK, Action.BAN, Action.UNBAN)


def admin(
    url: Annotated[str, typer.Argument(help="Of the server, or the link of an invitation.")],
    action: Annotated[Action, typer.Argument(help="What to do.")] = Action.LIST,
    who: Annotated[str, typer.Argument(help="Name or number of a user; a name for unban.")] = "",
    room: Annotated[
        str, typer.Option(help="Of a server with several: the same as URL/r/ROOM.")
    ] = "",
    force: Annotated[
        float | None,
        typer.Option(help="Of force-budget: N for all together; without it, no limit."),
    ] = None,
    token: Annotated[
        str,
        typer.Option(envvar="COHAPTIC_TOKEN", show_default=False, help="With roomAdmin."),
    ] = "",
    ca_file: Annotated[Path | None, typer.Option(help="Certificates that vouch for it.")] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Send a token also without TLS.")
    ] = False,
) -> None:
    """See who is in a room and who was put out; mute, kick, ban or unban somebody, freeze or reset
    the object.

    The token is one of `cohaptic token --admin`.
    """
    if bool(who) != (action in _TO_SOMEBODY):
        given = who or "not given"
        limit = f"given with {', '.join(one.value for one in _TO_SOMEBODY)}, and with no other"
        raise SettingError("user", repr(given[:60]), limit)
    if force is not None and not (action is Action.BUDGET and 0.0 <= force <= 1000.0):
        raise SettingError("--force", force, "given with force-budget, from 0 to 1000 N")
    address = read_address(url)
    token = address.token or token
    if token:
        check_secrecy(address.url, insecure=insecure)
    target = room_url(address.url, room)
    for line in asyncio.run(_act(target, token, str(ca_file or ""), action, who, force)):
        typer.echo(one_line(line, 400))


async def _act(
    url: str, token: str, ca_file: str, action: Action, who: str, force: float | None
) -> list[str]:
    """Connect and act; what there is to tell.

    Raises:
        ServerLost: There is no such server.
        Refused: It does not allow it.
    """
    try:
        async with (
            asyncio.timeout(_PATIENCE),
            connect(
                url,
                subprotocols=[Subprotocol(SUBPROTOCOL)],
                compression=None,
                proxy=None,
                max_size=MAX_BYTES,
                ssl=trust(url, ca_file),
            ) as ws,
        ):
            return await _talk(ws, token, action, who, force)
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
        raise ServerLost(url, "no server answers; start one with: cohaptic serve") from error


async def _talk(
    ws: ClientConnection, token: str, action: Action, who: str, force: float | None
) -> list[str]:
    watch = Watch(protocol=PROTOCOL_VERSION, encoding="forces", rate=1.0, token=token or None)
    await ws.send(encode_control(watch))
    watching = await _answer(ws, Watching)
    if action is Action.LIST:
        there = [f"{user.user}  {user.name}" for user in watching.users] or ["nobody touches"]
        if not watching.room_admin:
            return there
        return there + [f"put out: {name}" for name in (await _answer(ws, PutOut)).names]
    if action is Action.UNBAN:
        return [await _unban(ws, who)]
    user = _find(watching.users, who) if who else None
    name = "force_budget" if action is Action.BUDGET else action.value
    wish = Moderate.model_validate({"action": name, "user": user and user.user, "force": force})
    await ws.send(encode_control(wish))
    if not (await _answer(ws, Moderated)).done:
        return [f"{who} has left"]
    return [f"done: {action.value}{f' {user.name}' if user else ''}"]


async def _unban(ws: ClientConnection, who: str) -> str:
    """Let somebody come back who was put out; what there is to tell."""
    names = (await _answer(ws, PutOut)).names
    if who not in names:
        limit = f"one who was put out: {', '.join(names) or 'nobody was'}"
        raise SettingError("user", repr(who[:60]), limit)
    await ws.send(encode_control(Moderate(action="unban", name=who)))
    done = (await _answer(ws, Moderated)).done
    return f"done: unban {who}" if done else f"{who} may come back already"


def _find(users: tuple[WatchedUser, ...], who: str) -> WatchedUser:
    for user in users:
        if who in (user.name, str(user.user)):
            return user
    names = ", ".join(f"{user.user} {user.name}" for user in users) or "nobody touches"
    raise SettingError("user", repr(who[:60]), f"one of: {names}")


async def _answer(ws: ClientConnection, kind: type[M]) -> M:
    """The next message of a kind; raises Refused for an error."""
    while True:
        data = await ws.recv()
        if isinstance(data, bytes):
            continue  # the mesh, and scenes
        message = decode_watch_control(data)
        if isinstance(message, kind):
            return message
        if isinstance(message, Error):
            raise Refused(message.code, message.message)
