"""A stranger's way: the link of an invitation, opened in a browser."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Request

from cohaptic.clock import SystemClock
from cohaptic_server.access.keys import Grants, KeyRing
from cohaptic_server.access.tokens import Claims, sign
from cohaptic_server.credentials.key_file import new_key, save_keys
from tests.browser.conftest import Open, Serve
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live


def test_a_link_lets_in_once_and_its_session_outlives_a_reload(
    visitors: Open, serve: Serve, tmp_path: Path
) -> None:
    key, clock = new_key(), SystemClock()
    save_keys(tmp_path / "keys", KeyRing((key,)), replace=False)
    room = serve("--keys", str(tmp_path / "keys"), "--single-use")

    def link(**grants: bool) -> str:
        now = clock.now() + clock.to_wall()
        allowed = Grants(room="main", room_join=True, can_view=True, **grants)
        name = f"invitation-{sorted(grants)}".replace("'", "").replace(" ", "")
        claims = Claims(sub="ann", jti=name, iat=now, exp=now + 600.0, haptic=allowed)
        return f"{room.address}#token={sign(claims, key)}"

    invitation = link(can_touch=True)
    ann = visitors()
    ann.visit(invitation)
    ann.take_part("ann")
    ann.press(right=0.3)
    assert ann.steady_force() > 0.0
    assert "token" not in ann.page.url
    ann.page.reload()
    ann.until(ann.watches, "the session to come back")
    ann.take_part("ann")

    late = visitors()
    late.page.goto(invitation)
    late.until(lambda: "You need an invitation" in late.notice, "word that it was used")
    assert "used before" in late.notice

    bare = visitors()
    bare.page.goto(room.address)
    bare.until(lambda: "You need an invitation" in bare.notice, "word that one is needed")

    guest = visitors()
    guest.visit(link())
    guest.until(guest.watches, "the guest to watch")
    button = guest.page.get_by_role("button", name="Touch it")
    assert button.is_disabled()
    for visitor in (ann, late, bare, guest):
        visitor.away = True  # the server may end before the pages


def misled(ann: Visitor, address: str, secret: str) -> None:
    """She writes her token before the #, reads where it belongs, and puts it there."""
    asked: list[str] = []

    def note(request: Request) -> None:
        asked.append(request.url)

    ann.page.on("request", note)
    ann.page.goto(f"{address}?view=people&token={secret}")
    ann.until(lambda: "You need an invitation" in ann.notice, "that it was not used")
    assert "Tokens belong behind #" in ann.notice
    assert ann.page.url.endswith("/?view=people")
    assert [secret in url for url in asked] == [True] + [False] * (len(asked) - 1)
    # The page's own links are made of its address.
    assert secret not in ann.page.content()
    ann.page.goto(f"{address}#token={secret}")
    ann.until(ann.watches, "to be let in by the right link")
    assert "behind #" not in ann.notice
    ann.away = True  # the server may end before the page


def test_a_token_before_the_sign_is_in_no_address_and_no_log_and_the_page_tells_where_it_belongs(
    visitors: Open, serve: Serve, tmp_path: Path
) -> None:
    key, clock = new_key(), SystemClock()
    save_keys(tmp_path / "keys", KeyRing((key,)), replace=False)
    closed, open_room = serve("--keys", str(tmp_path / "keys")), serve()
    now = clock.now() + clock.to_wall()
    allowed = Grants(room="main", room_join=True, can_view=True)
    secret = sign(Claims(sub="ann", jti="ann", iat=now, exp=now + 600.0, haptic=allowed), key)

    for path in ("", "r/main", "r/main/"):
        misled(visitors(), f"{closed.address}{path}", secret)
    ben = visitors()
    ben.visit(f"{open_room.address}r/main?token={secret}")
    ben.until(lambda: "behind #" in ben.notice, "the same where nobody needs one")
    ben.page.get_by_role("button", name="Put this message away").click()
    assert ben.notice == ""
    logs = "".join(path.read_text() for path in tmp_path.glob("*.log"))
    assert secret.rpartition(".")[2] not in logs
    ben.away = True
