"""The page in a frame of another origin: refused unless the owner names that origin."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from cohaptic_server.http.routes import POLICY
from tests.browser.conftest import Open, Serve
from tests.browser.test_share import ask
from tests.browser.visitor import CLOCK, POLL, Look
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

# A browser that keeps third parties from storing anything throws at the mere word.
_FORBIDDEN = """
if (window !== top) {
  for (const name of ["localStorage", "sessionStorage"]) {
    Object.defineProperty(window, name, {
      get() { throw new DOMException("denied", "SecurityError"); },
    });
  }
}
"""


class _Host(BaseHTTPRequestHandler):
    """A page that shows another one in a frame."""

    def __init__(self, frame: list[str], *args: Any) -> None:
        self._frame = frame
        super().__init__(*args)

    def do_GET(self) -> None:
        frame = f'<iframe src="{self._frame[0]}" width="900" height="600"></iframe>'
        body = f"<!doctype html><title>host</title><link rel=icon href=data:,>{frame}".encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing."""


def until(page: Page, condition: Callable[[], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition():
        assert CLOCK.now() < deadline
        page.wait_for_timeout(POLL)


@pytest.fixture
def host() -> Iterator[tuple[str, list[str]]]:
    """Origin of such a page, and a list whose first is the address of its frame."""
    frame = [""]
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Host, frame))
    serving = threading.Thread(target=server.serve_forever, daemon=True)
    serving.start()
    yield f"http://127.0.0.1:{server.server_address[1]}", frame
    server.shutdown()
    serving.join()
    server.server_close()


def test_a_page_of_another_origin_shows_nothing_of_ours_unless_the_owner_lets_it(
    browser: Browser, serve: Serve, host: tuple[str, list[str]]
) -> None:
    origin, frame = host
    frame[0] = f"http://localhost:{serve().port}/"
    page = browser.new_page()
    refused: list[str] = []
    page.on("console", lambda message: refused.append(message.text))
    page.goto(origin)
    until(page, lambda: any("frame-ancestors" in text for text in refused))
    assert page.frame_locator("iframe").locator(".touch-button").count() == 0
    page.close()


def test_in_a_frame_without_storage_the_page_touches(
    browser: Browser, serve: Serve, host: tuple[str, list[str]]
) -> None:
    origin, frame = host
    room = serve("--allow-frame", origin)
    frame[0] = f"http://localhost:{room.port}/?name=framed&view=engineer"
    context = browser.new_context(viewport={"width": 960, "height": 640})
    context.add_init_script(_FORBIDDEN)
    page = context.new_page()
    problems: list[str] = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto(origin)
    inside = page.frame_locator("iframe")
    inside.locator(".lamp[data-phase=watching]").wait_for(timeout=1000 * PATIENCE)
    assert inside.locator(".app.engineer").count() == 1
    inside.locator(".touch-button").click()
    until(page, lambda: inside.locator(".dock-facts").text_content() == "in the air")
    # The hand has its own connection; that of the card may hear of it later.
    until(page, lambda: inside.locator(".card-name").all_inner_texts()[:1] == ["framed (you)"])
    assert problems == []
    context.close()


def test_the_words_to_copy_are_there_where_the_server_lets_frames(
    visitors: Open, serve: Serve
) -> None:
    lab = "https://lab.example"
    room = serve(
        "--host", "0.0.0.0", "--open", "--insecure", "--allow-host", "lab.example",
        "--allow-frame", lab,
    )  # fmt: skip
    ann = visitors(Look(1024, 720))
    ann.policies.add(POLICY.replace("frame-ancestors 'none'", f"frame-ancestors {lab}"))
    ann.visit(f"http://localhost:{room.port}/")
    ask(ann)
    ann.until(lambda: ann.page.locator(".share-frame").is_visible(), "the words")
    words = ann.page.input_value(".share-frame-words")
    assert words.startswith(f'<iframe src="http://lab.example:{room.port}/"')
    assert lab in ann.text(".share-frame")

    closed = visitors(Look(1024, 720))
    other = serve("--host", "0.0.0.0", "--open", "--insecure", "--allow-host", "lab.example")
    closed.visit(f"http://localhost:{other.port}/")
    ask(closed)
    closed.until(lambda: closed.page.locator(".share-qr").is_visible(), "the QR code")
    assert not closed.page.locator(".share-frame").is_visible()
