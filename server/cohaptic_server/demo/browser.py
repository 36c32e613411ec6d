"""Opens the demonstration's page in the default browser."""

from __future__ import annotations

import webbrowser

from cohaptic_server.http.page_files import has_page, load_page


def open_page(address: str) -> bool:
    """Open the page; False if it was not built, or no browser has a window of its own.

    A browser that runs in the terminal would hide the live view.
    """
    if not has_page(load_page()):
        return False
    try:
        browser = webbrowser.get()
    except webbrowser.Error:
        return False
    return not in_terminal(browser) and browser.open(address)


def in_terminal(browser: webbrowser.BaseBrowser) -> bool:
    """Whether a browser runs in the terminal that started it."""
    return isinstance(browser, webbrowser.GenericBrowser) and not isinstance(
        browser, webbrowser.BackgroundBrowser
    )
