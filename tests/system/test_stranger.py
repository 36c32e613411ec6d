"""A stranger's way from another machine: a link, a touch, a kick, a refusal.

Server and guest have a network namespace of their own each, so that nothing of loopback helps. The
owner and the guest use what a new user has: `cohaptic key`, `serve`, `invite`, `token`, `admin`,
and Chromium.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright

from cohaptic_server.http.routes import has_page, load_page
from tests.browser.chromium import FLAGS, NAMES
from tests.browser.visitor import Visitor
from tests.give_up import give_up
from tests.server.credentials.pairs import write_authority, write_pair
from tests.system.namespaces import Namespace, two_namespaces

pytestmark = pytest.mark.alone


def chromium() -> str:
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        give_up("Chromium is not here: apt-get install chromium")
    if not has_page(load_page()):
        give_up("the page was not built: make page")
    return path


def serve(home: Namespace, folder: Path) -> tuple[subprocess.Popen[str], str]:
    """The server, and its address."""
    certificate, key = write_pair(folder, home.address)
    home.cohaptic("key", str(folder / "keys"))
    with (folder / "server.log").open("w") as log:
        process = subprocess.Popen(
            home.command(
                sys.executable, "-m", "cohaptic", "serve", "--host", home.address, "--port", "0",
                "--keys", str(folder / "keys"), "--tls-cert", str(certificate),
                "--tls-key", str(key), "--state", str(folder / "state"), "--lifeline",
            ),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True,
        )  # fmt: skip
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line.startswith("listening wss://"), (folder / "server.log").read_text()
    return process, line.removeprefix("listening ").strip()


def test_a_guest_from_another_network_touches_is_kicked_and_comes_back_refused(
    tmp_path: Path,
) -> None:
    browser_program = chromium()
    with two_namespaces() as (home, away):
        server, url = serve(home, tmp_path)
        try:
            page = url.replace("wss:", "https:") + "/"
            keys = ("--keys", str(tmp_path / "keys"))
            link = home.cohaptic("invite", page, *keys, "--sub", "ann").stdout.strip()
            rights = home.cohaptic("token", *keys, "--admin").stdout.strip()
            trusted = ("--ca-file", str(write_authority(tmp_path)))

            def admin(*order: str) -> str:
                return away.cohaptic("admin", url, *order, "--token", rights, *trusted).stdout

            assert admin("list") == "nobody touches\n"
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(
                    executable_path=away.wrap(browser_program, tmp_path / "chromium"),
                    args=list(FLAGS),
                )
                # The authority of the test is in no store of the system's.
                guest = Visitor(browser.new_context(ignore_https_errors=True).new_page())
                guest.visit(link)
                guest.take_part("ann")
                guest.press(right=0.3)
                assert guest.steady_force() > 0.0
                assert "ann" in admin("list")
                assert admin("kick", "ann") == "done: kick ann\n"
                guest.until(lambda: "You are out of this room" in guest.notice, "word of it")
                guest.page.reload()
                guest.until(lambda: "You are out of this room" in guest.notice, "a refusal")
                again = Visitor(browser.new_context(ignore_https_errors=True).new_page())
                again.visit(link)  # the same invitation, by another name: a kick is of the session
                assert admin("list") == "nobody touches\nput out: ann\n"
                assert admin("unban", "ann") == "done: unban ann\n"
                guest.page.reload()
                guest.until(guest.watches, "the room to be open again")
                for visitor in (guest, again):
                    visitor.away = True
                problems = [p for v in (guest, again) for p in v.problems if "4403" not in p]
                assert problems == []
                browser.close()
            native = away.cohaptic(
                "touch", url, "--name", "no-token", "--duration", "1", *trusted, check=False
            )
            assert native.returncode != 0
            assert "token" in native.stderr
        finally:
            assert server.stdin is not None
            assert server.stdout is not None
            server.stdin.close()
            server.wait(20.0)
            server.stdout.close()
        assert "Traceback" not in (tmp_path / "server.log").read_text()
