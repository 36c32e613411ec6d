"""Chromium as the system has it; nothing is downloaded."""

from __future__ import annotations

import shutil
from collections.abc import Sequence

from playwright.sync_api import Browser, Playwright

from cohaptic_server.http.routes import has_page, load_page
from tests.give_up import give_up

NAMES = ("chromium", "chromium-browser", "google-chrome")
# WebGL in software, the same on every machine; no news of its own over the network.
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
)  # fmt: skip


def open_browser(playwright: Playwright, more: Sequence[str] = ()) -> Browser:
    """A browser with further flags; skips the test where none is installed."""
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        give_up("Chromium is not here: apt-get install chromium")
    if not has_page(load_page()):
        give_up("the page was not built: make page")
    return playwright.chromium.launch(executable_path=path, args=[*FLAGS, *more])
