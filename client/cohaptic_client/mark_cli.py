"""`cohaptic mark`: sets marks in the recording of a session."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from cohaptic.errors import SettingError
from cohaptic_client.room_options import CaFile, Insecure, RoomName

if TYPE_CHECKING:
    from cohaptic_client.network.marks import Value


# Above 60 lines: every option of the command is a parameter.
def mark(
    text: Annotated[
        str, typer.Argument(help='What the mark says: "stimulus on".', show_default=False)
    ] = "",
    url: Annotated[
        str, typer.Argument(help="Address of the server, or the link of an invitation.")
    ] = "ws://127.0.0.1:8765",
    given: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A further value: trial=3, side=left."),
    ] = None,
    lines: Annotated[
        bool, typer.Option("--lines", help="Set a mark for each line of standard input.")
    ] = False,
    lsl: Annotated[
        bool,
        typer.Option(
            "--lsl",
            help="Set a mark for each marker of a Lab Streaming Layer stream, TEXT being the name"
            " of the stream, until Ctrl-C. Needs the extra lsl.",
        ),
    ] = False,
    room: RoomName = "",
    token: Annotated[
        str,
        typer.Option(
            envvar="COHAPTIC_TOKEN", show_default=False, help="Of an invitation that may touch."
        ),
    ] = "",
    ca_file: CaFile = None,
    insecure: Insecure = False,
) -> None:
    """Set a mark in the recording of a session, such as the begin of a trial.

    It is an error if nothing records the session. A program that sets many marks keeps one
    connection with --lines: one JSON object a line with `text` and further values, or plain text;
    the address then is the only argument. At most 20 marks a second leave.
    """
    if lines and lsl:
        raise SettingError("--lines", "given", "left out beside --lsl")
    if lines and "://" in text:  # no mark says an address
        text, url = "", text
    if lines == bool(text) and not lsl:
        raise SettingError("text", repr(text[:60]), "given without --lines, and not with it")
    import asyncio

    from cohaptic_client.address import room_at
    from cohaptic_client.marking import set_one, set_stream
    from cohaptic_client.network.marks import mark_of

    address = room_at(url, token, room, insecure=insecure)
    there = (address.url, address.token, str(ca_file or ""))
    if lsl:
        from cohaptic_client.lsl import markers

        asyncio.run(set_stream(*there, markers(text)))
    elif lines:
        from cohaptic_client.marking import from_lines

        asyncio.run(set_stream(*there, from_lines()))
    else:
        fields = dict(_value(one) for one in given or [])
        asyncio.run(set_one(*there, mark_of(text, fields)))


def _value(given: str) -> tuple[str, Value]:
    name, equals, text = given.partition("=")
    if not (name and equals):
        raise SettingError("--set", repr(given[:60]), "NAME=VALUE")
    try:
        value = json.loads(text)
    except ValueError:
        return name, text
    return name, value if isinstance(value, float | int | bool | None) else text
