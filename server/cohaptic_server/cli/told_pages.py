"""Where the page is, for who has started a server: also as a QR code, for a phone beside it."""

from __future__ import annotations

import io
import logging
import shutil
import sys
from collections.abc import Sequence
from typing import TextIO

from cohaptic_server.shell.listener import page_address

# Bright on black, as the blocks are the light modules: dark ones on a light terminal are the other
# way round, and not every phone reads that.
_COLOURS, _PLAIN = "\033[97;40m", "\033[0m"
_BORDER = 2  # modules; four are the norm, two are read, and lines are few


def tell_pages(url: str, others: Sequence[str], out: TextIO | None = None) -> None:
    """Say where the page is, here and for other machines.

    Args:
        url: URL of the server.
        others: Addresses of it that other machines may reach; the first is drawn.
        out: Where it is drawn, if that is a terminal; None for the standard error, as the log.
    """
    logging.info("page %s", page_address(url))
    for address in others:
        logging.info("page for other machines %s", page_address(address))
    where = sys.stderr if out is None else out
    if others and where.isatty():
        where.write(qr_code(page_address(others[0]), shutil.get_terminal_size().columns))
        where.flush()


def qr_code(address: str, columns: int) -> str:
    """An address in half blocks and the colours of a terminal; empty where it is too narrow.

    Args:
        address: To be opened.
        columns: Columns of the terminal.
    """
    import segno

    drawn = io.StringIO()
    segno.make(address, error="l", micro=False).terminal(drawn, border=_BORDER, compact=True)
    lines = drawn.getvalue().splitlines()
    if max(len(line) for line in lines) > columns:
        return ""
    return "".join(f"{_COLOURS}{line}{_PLAIN}\n" for line in lines)
