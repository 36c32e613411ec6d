from __future__ import annotations

import math

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.settings import ServerSettings


def test_a_server_nobody_told_anything_listens_to_this_machine_only() -> None:
    assert ServerSettings().host == "127.0.0.1"


@pytest.mark.parametrize("hz", [-60.0, 0.0, 9.99, 200.1, math.inf, math.nan])
def test_a_rate_out_of_range_is_refused_with_its_limits(hz: float) -> None:
    words = rf"simulation rate is {hz} Hz; it must be from 10 to 200 Hz"
    with pytest.raises(SettingError, match=words):
        ServerSettings(simulation_hz=hz)


@pytest.mark.parametrize(
    "frame",
    ["", "*", "lab.example", "https://*.example", "https://a b", "https://a;x", "https://a/b",
     "https://a,b", "https://a'b", "https://lab.example\n", "data:", "https://a:123456"],
)  # fmt: skip
def test_a_frame_that_would_say_more_than_one_origin_is_refused(frame: str) -> None:
    with pytest.raises(SettingError, match="it must be a scheme, a host and a port"):
        ServerSettings(allow_frames=(frame,))


@pytest.mark.parametrize("host", ["", "lab.example:8765", "http://lab", "a b", "*", "[::1]:80"])
def test_a_host_that_no_browser_would_name_is_refused(host: str) -> None:
    with pytest.raises(SettingError, match="it must be a name or an address without a port"):
        ServerSettings(allow_hosts=(host,))
