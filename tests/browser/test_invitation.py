"""A stranger's way: the link of an invitation, opened in a browser."""

from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic_server.access.grants import Grants
from cohaptic_server.access.keys import KeyRing
from cohaptic_server.access.tokens import Claims, sign
from cohaptic_server.credentials.key_file import new_key, save_keys
from tests.browser.conftest import Open, Serve

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
