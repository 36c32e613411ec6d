from __future__ import annotations

import webbrowser

import pytest

from cohaptic_tools.demo.demonstration import in_terminal


@pytest.mark.parametrize(
    ("browser", "terminal"),
    [
        (webbrowser.GenericBrowser("w3m"), True),
        (webbrowser.BackgroundBrowser("chromium"), False),
        (webbrowser.Mozilla("firefox"), False),
    ],
)
def test_only_a_browser_with_a_window_is_opened(
    browser: webbrowser.BaseBrowser, terminal: bool
) -> None:
    assert in_terminal(browser) == terminal
