"""Shows the owner of a server the address of its web page, also as a QR code for a phone."""

from __future__ import annotations

import io
import logging
import shutil
import sys
from collections.abc import Sequence
from typing import TextIO

from cohaptic_server.shell.listener import page_address

# White on black, since the printed blocks are the light modules of the code. With the colours of a
# light terminal the code would be inverted, and not every phone reads an inverted code.
_COLOURS, _PLAIN = "\033[97;40m", "\033[0m"
_BORDER = 2  # modules; the norm has four, phones also read two, and a terminal has few lines


def tell_pages(url: str, others: Sequence[str], out: TextIO | None = None) -> None:
    """Log the addresses of the page for this machine and for others, and draw a QR code.

    Args:
        url: URL of the server.
        others: URLs of the server for other machines; the code shows the first one.
        out: Stream to draw the code on, if it is a terminal; None for standard error.
    """
    logging.info("page %s", page_address(url))
    for address in others:
        logging.info("page for other machines %s", page_address(address))
    where = sys.stderr if out is None else out
    if others and where.isatty():
        where.write(qr_code(page_address(others[0]), shutil.get_terminal_size().columns))
        where.flush()


def qr_code(address: str, columns: int) -> str:
    """Return the QR code of an address, drawn with half-block characters.

    Args:
        columns: Width of the terminal [characters].

    Returns:
        Lines of the drawing; empty if the terminal is too narrow.
    """
    import segno

    drawn = io.StringIO()
    segno.make(address, error="l", micro=False).terminal(drawn, border=_BORDER, compact=True)
    lines = drawn.getvalue().splitlines()
    if max(len(line) for line in lines) > columns:
        return ""
    return "".join(f"{_COLOURS}{line}{_PLAIN}\n" for line in lines)
