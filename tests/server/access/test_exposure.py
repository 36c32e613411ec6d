from __future__ import annotations

import itertools

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.cli.access_options import Exposure

HERE = ["127.0.0.1", "127.0.0.9", "::1", "[::1]", "localhost"]
ELSEWHERE = ["0.0.0.0", "::", "", "10.0.0.1", "lab.example", "localhost.lab.example", "::2"]


@pytest.mark.parametrize("host", HERE)
def test_on_this_machine_anybody_comes_in_without_being_asked_for(host: str) -> None:
    alone = Exposure(host)
    alone.check()
    assert alone.is_local
    assert alone.admits_anybody
    assert not Exposure(host, keys=True).admits_anybody
    assert Exposure(host, keys=True, open=True).admits_anybody


@pytest.mark.parametrize("host", ELSEWHERE)
@pytest.mark.parametrize(
    ("keys", "anybody", "tls", "insecure"), list(itertools.product([False, True], repeat=4))
)
def test_elsewhere_both_have_to_be_decided(
    host: str, keys: bool, anybody: bool, tls: bool, insecure: bool
) -> None:
    exposure = Exposure(host, keys=keys, open=anybody, tls=tls, insecure=insecure)
    if (keys or anybody) and (tls or insecure):
        exposure.check()
        assert exposure.admits_anybody == anybody
        return
    with pytest.raises(SettingError) as caught:
        exposure.check()
    words = str(caught.value)
    assert ("--keys FILE" in words) == (not (keys or anybody))
    assert ("--tls-cert FILE" in words) == (not (tls or insecure))
    assert "\n" not in words


@pytest.mark.parametrize("host", HERE)
def test_behind_a_proxy_who_comes_in_has_to_be_decided(host: str) -> None:
    with pytest.raises(SettingError, match="through a proxy; it must be given with --keys"):
        Exposure(host, behind_proxy=True).check()
    Exposure(host, behind_proxy=True, open=True).check()
    Exposure(host, behind_proxy=True, keys=True).check()
