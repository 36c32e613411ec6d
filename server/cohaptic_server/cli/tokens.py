"""Commands `cohaptic key`, `cohaptic token` and `cohaptic invite`."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated
from urllib.parse import urlsplit

import typer

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.room_address import MAIN, room_in, room_url
from cohaptic_server.cli.access_options import InsecureKeyFile, seconds_of
from cohaptic_server.cli.option_groups import takes


@dataclass(frozen=True, slots=True)
class GrantOptions:
    """Rights that a token grants; each field is one option of the command line."""

    keys: Annotated[
        Path,
        typer.Option(
            envvar="COHAPTIC_KEYS", help="File that `cohaptic key` made; its first key signs."
        ),
    ]
    insecure_key_file: InsecureKeyFile = False
    room: Annotated[
        str,
        typer.Option(
            help="Room, or lab-* for all whose names begin so.",
            show_default="that of an invitation's address, or main",
        ),
    ] = ""
    sub: Annotated[
        str,
        typer.Option(
            help="Name of the guest in the log, without spaces.", show_default="a new one"
        ),
    ] = ""
    watch_only: Annotated[bool, typer.Option("--watch-only", help="May watch, and not touch.")] = (
        False
    )
    max_force: Annotated[
        float | None, typer.Option(help="Largest force of this guest on the object [N].")
    ] = None
    latency: Annotated[
        bool, typer.Option("--latency", help="May inject latency, if the server allows it.")
    ] = False
    admin: Annotated[
        bool, typer.Option("--admin", help="May mute, kick and ban, freeze and reset.")
    ] = False
    record: Annotated[bool, typer.Option("--record", help="May record the others.")] = False
    create: Annotated[
        bool, typer.Option("--create", help="May make rooms; no server has a use for it yet.")
    ] = False

    def token(self, valid: str, room: str = MAIN) -> str:
        """Return the signed token that these options describe.

        Args:
            valid: Time for which the token is valid, such as 10m.
            room: Room of the token if --room is missing.

        Raises:
            SettingError: An option is out of its range.
        """
        from pydantic import ValidationError

        from cohaptic_server.access.keys import Grants
        from cohaptic_server.access.tokens import Claims, sign
        from cohaptic_server.credentials.key_file import load_keys

        clock = SystemClock()
        now = clock.now() + clock.to_wall()
        try:
            claims = Claims(
                sub=self.sub or f"guest-{secrets.token_hex(4)}",
                jti=secrets.token_hex(16),
                iat=now,
                exp=now + seconds_of("--valid", valid),
                haptic=Grants(
                    room=self.room or room,
                    room_join=True,
                    can_touch=not self.watch_only,
                    can_view=True,
                    room_create=self.create,
                    room_admin=self.admin,
                    room_record=self.record,
                    can_inject_latency=self.latency,
                    max_force=self.max_force,
                ),
            )
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            name = str(first["loc"][-1]).replace("maxForce", "--max-force")
            limit = "as `cohaptic token --help` says: " + str(first["msg"])
            raise SettingError(name, repr(first["input"])[:60], limit) from error
        return sign(claims, load_keys(self.keys, insecure=self.insecure_key_file).signer)


def key(
    file: Annotated[Path, typer.Argument(help="Written with mode 0600.")],
    rotate: Annotated[
        bool, typer.Option("--rotate", help="Put a new key in front; the old ones stay accepted.")
    ] = False,
    keep: Annotated[
        int | None,
        typer.Option(help="With --rotate: how many old ones; 0 takes all of them out."),
    ] = None,
    insecure_key_file: InsecureKeyFile = False,
) -> None:
    """Make the key that invitations are signed with.

    A server that runs reads the file again when it changes.
    """
    from cohaptic_server.access.keys import MAX_KEYS, KeyRing
    from cohaptic_server.credentials.key_file import load_keys, new_key, save_keys

    if keep is not None and (not rotate or not 0 <= keep < MAX_KEYS):
        raise SettingError("--keep", keep, f"given with --rotate, from 0 to {MAX_KEYS - 1}")
    fresh = new_key()
    ring = KeyRing((fresh,))
    if rotate:
        before = load_keys(file, insecure=insecure_key_file)
        ring = before.rotated(fresh, MAX_KEYS - 1 if keep is None else keep)
    save_keys(file, ring, replace=rotate)
    typer.echo(f"key {fresh.kid} signs from now on; {len(ring.keys) - 1} more are accepted")


@takes(GrantOptions)
def token(
    *, grants: GrantOptions, valid: Annotated[str, typer.Option(help="30s, 10m, 12h, 7d.")] = "10m"
) -> None:
    """Print a token, for `cohaptic touch` in COHAPTIC_TOKEN.

    Who has come in by it stays when it ends, and comes back for up to 12 hours after it came in;
    where the server was started with --session-valid, it is closed so long after the token's end.
    """
    typer.echo(grants.token(valid))


@takes(GrantOptions)
def invite(
    url: Annotated[str, typer.Argument(help="Of the page: https://lab.example/.")],
    *,
    grants: GrantOptions,
    valid: Annotated[str, typer.Option(help="30s, 10m, 12h, 7d.")] = "1d",
) -> None:
    """Print a link that invites a person to touch or watch.

    Whoever has the link may come in until it ends: send it as you would send a password. It leads
    to the room of --room, also from the address of the server alone. Who has come in by it stays
    when it ends, and comes back, as `cohaptic token --help` says.
    """
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise SettingError("address of the page", repr(url[:60]), "https://HOST/ or http://HOST/")
    if parts.query or parts.fragment:
        raise SettingError("address of the page", repr(url[:60]), "without ? and #")
    page = _page_of(url, grants.room)
    typer.echo(f"{page}#token={grants.token(valid, room_in(page) or MAIN)}")


def _page_of(url: str, room: str) -> str:
    """Return the URL of the page to which an invitation to a room leads.

    Args:
        url: URL of the server, or of the room.
        room: Room of the token, or a prefix with a star; empty for the room of the URL.

    Raises:
        SettingError: The URL names a room that would refuse the token.
    """
    page, named = url if urlsplit(url).path else f"{url}/", room_in(url)
    if room.endswith("*"):
        if named is not None and not named.startswith(room[:-1]):
            raise SettingError("--room", room, f"one that holds in {named}, as the address says")
        return page
    # The room `main` is at the root, also on a server with one room.
    if not room or (room == MAIN and named is None):
        return page
    return page if named == room else f"{room_url(page, room)}/"
