from __future__ import annotations

import io
import logging

import pytest
import segno

from cohaptic_server.cli.told_pages import qr_code, tell_pages

ADDRESS = "http://192.0.2.2:8765/r/liver/"
# Light modules are drawn: of each block the upper and the lower half.
HALVES = {"█": (0, 0), "▀": (0, 1), "▄": (1, 0), " ": (1, 1)}


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("address", [ADDRESS, ADDRESS + 200 * "x"])
def test_every_module_of_the_code_is_drawn_bright_on_black(address: str) -> None:
    lines = qr_code(address, 200).splitlines()
    rows: list[list[int]] = []
    for line in lines:
        assert line.startswith("\033[97;40m")
        assert line.endswith("\033[0m")
        halves = [HALVES[block] for block in line[len("\033[97;40m") : -len("\033[0m")]]
        rows += [[upper for upper, _ in halves], [lower for _, lower in halves]]
    code = segno.make(address, error="l", micro=False)
    expected = [[int(dark) for dark in row] for row in code.matrix_iter(border=2)]
    # An odd number of rows leaves half a line over.
    assert rows[: len(expected)] == expected


def test_the_address_for_others_is_drawn_on_a_terminal_and_the_log_has_all(
    caplog: pytest.LogCaptureFixture,
) -> None:
    terminal, file = Terminal(), io.StringIO()
    with caplog.at_level(logging.INFO):
        for out in (terminal, file):
            tell_pages("ws://0.0.0.0:8765", ["ws://192.0.2.2:8765", "ws://192.0.2.3:8765"], out)
        tell_pages("ws://127.0.0.1:8765", [], Terminal())
    assert terminal.getvalue() == qr_code("http://192.0.2.2:8765/", 80)
    assert file.getvalue() == ""
    told = [record.getMessage() for record in caplog.records]
    assert told.count("page for other machines http://192.0.2.3:8765/") == 2
    assert "page http://127.0.0.1:8765/" in told
