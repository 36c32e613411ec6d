from __future__ import annotations

from functools import partial

import pytest

from cohaptic.status.report import TouchStatus
from cohaptic.status.row import COLUMNS, Row
from cohaptic_client.network.timing import LinkTiming, Passage
from cohaptic_client.news import silence_in_words
from cohaptic_client.settings import ClientSettings
from cohaptic_client.touch_state import state_in_words, touch_status

SETTINGS = ClientSettings(url="ws://127.0.0.1:1", name="left")
ROW = Row(*[0.0] * len(COLUMNS))._replace(tick=7, scale=1.0, fx=3.0, fy=4.0, wanted=5.0)


def status(row: Row, timing: LinkTiming, settings: ClientSettings = SETTINGS) -> TouchStatus:
    return touch_status(
        settings,
        row,
        {"loop_hz": 999.5, "missed": 2, "fault": "why"},
        timing,
        server_to_wall=100.0,
        to_wall=70.0,
        silent_after=0.1,
        stopping=False,
    )


@pytest.mark.parametrize(
    ("changes", "stopping", "expected"),
    [
        ({}, True, "stopped"),
        ({"tick": 0}, False, "connecting"),
        ({"patch_age": 0.2, "scale": 0.5}, False, "server silent"),
        # On a link that jitters the loop may still be patient.
        ({"patch_age": 0.2}, False, "touching"),
        ({"scale": 0.0}, False, "waiting"),
        ({"wanted": 0.0}, False, "free"),
        ({}, False, "touching"),
    ],
)
def test_the_state_in_words(changes: dict[str, float], stopping: bool, expected: str) -> None:
    row = ROW._replace(**changes)
    assert state_in_words(row, silent_after=0.1, stopping=stopping) == expected


def test_a_device_that_sends_nothing_is_told_before_a_silent_server_and_after_a_fault() -> None:
    row = ROW._replace(patch_age=0.2, scale=0.5)
    words = partial(state_in_words, row, silent_after=0.1, stopping=False, device_silent=True)
    assert (words(), words(held=True)) == ("device silent", "fault")
    assert "in reach" in silence_in_words({"device_silent": True})
    assert silence_in_words({"device_silent": False}) == silence_in_words({}) == ""


def test_a_status_has_the_row_the_report_of_the_loop_and_the_timing_of_the_link() -> None:
    timing = LinkTiming(0.02, 0.001, Passage(0.018, -29.5))
    found = status(ROW, timing)
    assert (found.force, found.state, found.along) == (5.0, "touching", None)
    assert (found.loop_hz, found.loop_missed, found.fault) == (999.5, 2, "why")
    assert (found.round_trip, found.jitter) == (0.02, 0.001)
    # Server's wall clock less this machine's: -29.5 + 100 - 70.
    assert found.clock_offset == pytest.approx(0.5)
    assert found.clock_error == pytest.approx(0.009)
    assert status(ROW, LinkTiming()).clock_offset == 0.0
