from __future__ import annotations

import stat
import sys
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.room_address import split_path
from cohaptic_client.address import read_address
from cohaptic_server.access.keys import Grants
from cohaptic_server.access.tokens import Claims, verify
from cohaptic_server.cli.tokens import invite, key, token
from cohaptic_server.credentials.key_file import load_keys


def run(command: Any, *arguments: object) -> str:
    app = typer.Typer()
    app.command()(command)
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if isinstance(result.exception, Exception):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output.strip()


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    run(key, tmp_path / "keys")
    return tmp_path / "keys"


def read(text: str, keys: Path, later: float = 0.0) -> Claims:
    clock = SystemClock()
    return verify(text, load_keys(keys), clock.now() + clock.to_wall() + later)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
def test_nobody_else_may_read_a_key_file(keys: Path) -> None:
    assert stat.S_IMODE(keys.stat().st_mode) == 0o600
    run(key, keys, "--rotate")
    assert stat.S_IMODE(keys.stat().st_mode) == 0o600
    assert [path.name for path in keys.parent.iterdir()] == ["keys"]


def test_a_key_file_is_never_written_over(keys: Path) -> None:
    before = keys.read_bytes()
    with pytest.raises(SettingError, match="--rotate"):
        run(key, keys)
    assert keys.read_bytes() == before
    with pytest.raises(SettingError, match="can be written"):
        run(key, keys.parent / "nowhere" / "keys")


def test_a_rotated_key_is_accepted_until_it_is_taken_out(keys: Path) -> None:
    old = run(token, "--keys", keys)
    run(key, keys, "--rotate")
    read(old, keys)
    assert read(run(token, "--keys", keys), keys).haptic.can_touch
    run(key, keys, "--rotate", "--keep", 0)
    with pytest.raises(Exception, match="no key"):
        read(old, keys)
    with pytest.raises(SettingError, match="--keep"):
        run(key, keys, "--keep", 1)


def test_a_token_says_what_was_asked_for_and_no_more(keys: Path) -> None:
    plain = read(run(token, "--keys", keys), keys)
    assert plain.haptic == Grants(room="main", room_join=True, can_touch=True, can_view=True)
    assert plain.exp - plain.iat == 600.0
    options = ("--watch-only", "--admin", "--latency", "--record", "--create", "--max-force", "2.5")
    full = run(token, "--keys", keys, "--room", "lab-*", "--sub", "anna", *options)
    said = read(full, keys)
    assert said.sub == "anna"
    assert said.haptic == Grants(
        room="lab-*", room_join=True, can_view=True, room_create=True, room_admin=True,
        room_record=True, can_inject_latency=True, max_force=2.5,
    )  # fmt: skip


def test_an_invitation_is_a_link_with_the_token_where_no_server_sees_it(keys: Path) -> None:
    link = run(invite, "https://lab.example", "--keys", keys, "--valid", "7d")
    address, _, fragment = link.partition("#")
    assert address == "https://lab.example/"
    said = read(fragment.removeprefix("token="), keys, later=6.9 * 86400.0)
    assert said.haptic.can_touch
    # A terminal takes the same link.
    there = read_address(link)
    assert (there.url, f"token={there.token}") == ("wss://lab.example/", fragment)


@pytest.mark.parametrize(
    ("url", "given", "page", "room"),
    [
        ("http://h:1", "", "http://h:1/", "main"),
        ("http://h:1/", "main", "http://h:1/", "main"),
        ("http://h:1", "two", "http://h:1/r/two/", "two"),
        ("https://h/lab/", "two", "https://h/lab/r/two/", "two"),
        ("http://h:1/r/two", "", "http://h:1/r/two", "two"),
        ("http://h:1/r/two/", "two", "http://h:1/r/two/", "two"),
        ("http://h:1/r/lab-1/", "lab-*", "http://h:1/r/lab-1/", "lab-*"),
        ("http://h:1/", "lab-*", "http://h:1/", "lab-*"),
    ],
)
def test_the_link_leads_to_the_room_that_its_token_is_for(
    url: str, given: str, page: str, room: str, keys: Path
) -> None:
    more = ("--room", given) if given else ()
    address, _, fragment = run(invite, url, "--keys", keys, *more).partition("#token=")
    grants = read(fragment, keys).haptic
    assert (address, grants.room) == (page, room)
    # What the address asks for is what the server compares with.
    asked, _ = split_path(urlsplit(address).path.removeprefix("/lab"))
    assert asked is None or grants.hold_in(asked)


@pytest.mark.parametrize("room", ["three", "main", "lab-*"])
def test_a_link_to_another_room_than_the_token_s_is_not_made(room: str, keys: Path) -> None:
    with pytest.raises(SettingError, match="--room"):
        run(invite, "http://h:1/r/two/", "--keys", keys, "--room", room)


@pytest.mark.parametrize(
    "arguments",
    [
        ("--valid", "soon"),
        ("--valid", "0s"),
        ("--valid", "500d"),
        ("--valid", "-1m"),
        ("--valid", "inf"),
        ("--room", "a b"),
        ("--sub", "a b"),
        ("--sub", "ä"),
        ("--max-force", "-1"),
        ("--max-force", "nan"),
    ],
)
def test_an_option_out_of_range_is_a_sentence(arguments: tuple[str, str], keys: Path) -> None:
    with pytest.raises(SettingError) as caught:
        run(token, "--keys", keys, *arguments)
    assert "\n" not in str(caught.value)
