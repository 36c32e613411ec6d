"""`cohaptic admin`: lists the users of a room, and performs the actions of an administrator."""

from __future__ import annotations

from typing import Annotated

import typer

from cohaptic.errors import SettingError, one_line
from cohaptic_client.admin_action import TO_SOMEBODY, Action
from cohaptic_client.room_options import CaFile, Insecure, RoomName

_ACTIONS = ", ".join(action.value for action in Action)


def admin(
    url: Annotated[
        str, typer.Argument(help="Address of the server, or the link of an invitation.")
    ],
    # A text, since the words are too many for the line on which typer would list them.
    action: Annotated[str, typer.Argument(help=f"One of: {_ACTIONS}.")] = Action.LIST.value,
    who: Annotated[str, typer.Argument(help="Name or number of a user; a name for unban.")] = "",
    room: RoomName = "",
    force: Annotated[
        float | None,
        typer.Option(help="Largest force of all together [N], for force-budget; else no limit."),
    ] = None,
    token: Annotated[
        str,
        typer.Option(
            envvar="COHAPTIC_TOKEN", show_default=False, help="Made by `cohaptic token --admin`."
        ),
    ] = "",
    ca_file: CaFile = None,
    insecure: Insecure = False,
) -> None:
    """See who is in a room; kick, mute, ban, freeze, reset, record.

    `unban` lets a user who was kicked or banned under a name come back. The token is one of
    `cohaptic token --admin`. `record` needs a server with --recordings, and takes a token with
    --record, too; of a server without access control, which takes no tokens, record by
    `cohaptic serve --record`, or by `cohaptic.record(...)` in a script on its machine.
    """
    try:
        wanted = Action(action)
    except ValueError as error:
        raise SettingError("action", repr(action[:60]), f"one of {_ACTIONS}") from error
    if bool(who) != (wanted in TO_SOMEBODY):
        given = who or "not given"
        limit = f"given with {', '.join(one.value for one in TO_SOMEBODY)}, and with no other"
        raise SettingError("user", repr(given[:60]), limit)
    if force is not None and not (wanted is Action.BUDGET and 0.0 <= force <= 1000.0):
        raise SettingError("--force", force, "given with force-budget, from 0 to 1000 N")
    import asyncio

    from cohaptic_client.address import room_at
    from cohaptic_client.moderation import act

    address = room_at(url, token, room, insecure=insecure)
    for line in asyncio.run(
        act(address.url, address.token, str(ca_file or ""), wanted, who, force)
    ):
        typer.echo(one_line(line, 400))
