"""Opens pages in the browser of this machine."""

from __future__ import annotations

import webbrowser

from cohaptic_server.http.routes import has_page, load_page


def open_page(address: str) -> bool:
    """Open the web page in a graphical browser; return False if there is no page or browser.

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
