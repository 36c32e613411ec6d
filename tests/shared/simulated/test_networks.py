from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.networks import NETWORKS, read_network, words_for

links = st.builds(
    LinkSettings,
    **{
        name: st.integers(0, 5000).map(lambda ms: 1e-3 * ms) for name in ("delay", "jitter", "tail")
    },
    memory=st.integers(0, 60).map(float),
    loss=st.integers(0, 50).map(lambda percent: 1e-2 * percent),
    stall=st.integers(1, 5000).map(lambda ms: 1e-3 * ms),
    stalls=st.integers(1, 120).map(lambda times: times / 60.0),
)


@given(links)
def test_what_is_written_is_read_as_the_same_link(link: LinkSettings) -> None:
    again = read_network(words_for(link))
    for name in ("delay", "jitter", "tail", "memory", "loss", "stall", "stalls"):
        assert getattr(again, name) == pytest.approx(getattr(link, name), rel=1e-8)


@pytest.mark.parametrize("name", NETWORKS)
def test_a_name_is_a_network_and_words_after_it_replace_its_own(name: str) -> None:
    link = read_network(name)
    assert link == NETWORKS[name].link
    other = read_network(f"{name}, delay=30, loss=1")
    assert (other.delay, other.loss, other.tail) == (0.03, 0.01, link.tail)
    assert read_network(f"LOSS = 1, Delay=30 ,{name.upper()}") == other
    assert NETWORKS[name].source


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wify", "one of: lan, wifi"),
        ("speed=3", "NAME=VALUE of: delay"),
        ("delay=much", "delay of a network is 'much'; it must be a number from 0 to 5000 ms"),
        ("delay=-1", "delay of a network is '-1'"),
        ("loss=60", "loss of a network is '60'; it must be a number from 0 to 50 %"),
        ("stalls=nan", "from 0 to 120 /min"),
        ("wifi,4g", "one name at most"),
        ("stall=300", "given with stalls=6"),
        ("stalls=6", "given with stall=300"),
        ("=", "one of: lan"),
    ],
)
def test_other_words_say_what_is_known(text: str, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        read_network(text)
