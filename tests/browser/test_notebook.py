"""A view in a real JupyterLab: the page of the server in a cell, and the forces below it."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Error, Page

from tests.browser.conftest import Serve
from tests.browser.visitor import CLOCK, POLL
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

pytest.importorskip("jupyterlab", reason="pip install 'cohaptic[notebook-tests]'")

NOTEBOOK = Path(__file__).parents[2] / "examples/step_8_notebook.ipynb"
PICTURES = Path(__file__).parents[2] / "out/browser"
TOKEN = "of-the-test"
FRAME = "iframe[title=cohaptic]"


def until(page: Page, condition: Callable[[], bool], what: str) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition():
        assert CLOCK.now() < deadline, f"waited for {what}; there is {page.inner_text('body')}"
        page.wait_for_timeout(POLL)


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    """A JupyterLab that knows no settings of this user: its origin, and its folder."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    places = ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR",
              "JUPYTERLAB_SETTINGS_DIR", "JUPYTERLAB_WORKSPACES_DIR")  # fmt: skip
    settings = {place: str(tmp_path / place.lower()) for place in places}
    folder = tmp_path / "notebooks"
    folder.mkdir()
    command = [
        sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--ip=127.0.0.1",
        f"--port={port}", f"--IdentityProvider.token={TOKEN}", f"--ServerApp.root_dir={folder}",
        "--LabApp.expose_app_in_browser=True", "--LabApp.extension_manager=readonly",
    ]  # fmt: skip
    with (tmp_path / "lab.log").open("wb") as log:
        lab = subprocess.Popen(command, env={**os.environ, **settings}, stdout=log, stderr=log)
        try:
            yield f"http://localhost:{port}", folder
        finally:
            lab.terminate()  # kernels, too
            lab.wait()


class Cells:
    """An open notebook, whose cells are run by its own commands."""

    def __init__(self, browser: Browser, lab: tuple[str, Path], cells: list[Any]) -> None:
        origin, folder = lab
        whole = json.loads(NOTEBOOK.read_text("utf-8"))
        (folder / "step.ipynb").write_text(json.dumps({**whole, "cells": cells}), "utf-8")
        self.page = browser.new_page(viewport={"width": 1280, "height": 900})
        deadline = CLOCK.now() + PATIENCE
        while True:
            try:
                self.page.goto(f"{origin}/doc/tree/step.ipynb?token={TOKEN}")
                break
            except Error:  # it is still starting
                assert CLOCK.now() < deadline
                self.page.wait_for_timeout(POLL)
        # Cells that are run while there is no kernel yet are not run at all.
        self.page.get_by_text(re.compile(r"^Python 3.*\| Idle")).wait_for(timeout=1000 * PATIENCE)

    def run(self, count: int) -> None:
        """Run the next cells; the call does not wait for them."""
        for _ in range(count):
            self.page.evaluate(
                "void jupyterapp.commands.execute('notebook:run-cell-and-select-next')"
            )

    def foot(self) -> str:
        """Of the last view: the forces, and what it does."""
        found = self.page.locator(".jp-OutputArea-output", has_text=re.compile(" · ")).last
        return found.inner_text() if found.count() else ""


def test_a_notebook_shows_the_room_and_the_forces_as_they_come(
    browser: Browser, lab: tuple[str, Path]
) -> None:
    cells = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    notebook = Cells(browser, lab, cells)
    page = notebook.page
    notebook.run(4)
    inside = page.frame_locator(FRAME)
    inside.locator(".lamp[data-phase=watching]").wait_for(timeout=1000 * PATIENCE)
    inside.locator(".stage-host[aria-busy=false]").wait_for(timeout=1000 * PATIENCE)
    assert "nobody touches" in notebook.foot()
    notebook.run(len(cells) - 5)  # all but the last, which takes the picture away
    until(page, lambda: re.search(r"ann [2-9]\.\d\d N", notebook.foot()) is not None, "a press")
    page.locator(".jp-OutputArea-output img").wait_for(timeout=1000 * PATIENCE)
    names = inside.locator(".card-name").all_inner_texts()
    assert sorted(names) == ["ann", "bob"]
    page.locator(FRAME).scroll_into_view_if_needed()
    page.wait_for_timeout(5 * POLL)
    page.screenshot(path=PICTURES / "notebook.png")
    notebook.run(1)
    page.locator(FRAME).wait_for(state="detached", timeout=1000 * PATIENCE)
    page.close()


def test_where_the_server_lets_no_notebook_show_it_the_cell_says_what_to_do(
    browser: Browser, lab: tuple[str, Path], serve: Serve
) -> None:
    room = serve()
    cell: dict[str, Any] = {
        "id": "one", "cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [],
        "source": f"import cohaptic\ncohaptic.view({room.url!r})",
    }  # fmt: skip
    notebook = Cells(browser, lab, [cell])
    notebook.run(1)
    page = notebook.page
    page.get_by_text("does not show here").wait_for(timeout=1000 * PATIENCE)
    assert f"cohaptic serve --allow-frame {lab[0]}" in page.inner_text("body")
    assert (
        page.get_by_text("Open it in a tab").get_attribute("href") == f"{room.address}?view=people"
    )
    page.screenshot(path=PICTURES / "notebook-refused.png")
    with room.hand("ann"):
        until(page, lambda: "ann" in notebook.foot(), "the forces all the same")
    room.close()
    until(page, lambda: "not connected" in notebook.foot(), "the end of the server")
    page.close()
