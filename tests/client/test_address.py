from __future__ import annotations

from urllib.parse import urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_client.address import (
    Address,
    check_secrecy,
    proxy_for,
    read_address,
    silence,
    with_slash,
)
from cohaptic_client.settings import ClientSettings


@pytest.mark.parametrize(
    ("said", "url", "token"),
    [
        ("ws://127.0.0.1:8765", "ws://127.0.0.1:8765", ""),
        ("https://lab.example/#token=a.b.c", "wss://lab.example/", "a.b.c"),
        ("https://lab.example/r/two#x=1&token=a.b-_.c", "wss://lab.example/r/two", "a.b-_.c"),
        ("http://[::1]:8765/#token=a", "ws://[::1]:8765/", "a"),
        # A query is nowhere for a token, and none is taken from there.
        ("https://lab.example/?token=a", "wss://lab.example/", ""),
        ("nonsense", "nonsense", ""),
        ("ftp://lab.example#token=a", "ftp://lab.example#token=a", ""),
        ("ws://[half", "ws://[half", ""),
    ],
)
def test_a_link_is_an_address_and_a_token(said: str, url: str, token: str) -> None:
    assert read_address(said) == Address(url, token)


@given(st.text(max_size=60))
def test_any_text_is_an_address_or_left_as_it_is(said: str) -> None:
    read = read_address(said)
    assert read.url == said or read.url.startswith(("ws:", "wss:"))


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.0.1:9", "localhost:8765", "[::1]:8765"])
def test_a_token_may_go_to_this_machine_without_tls(host: str) -> None:
    check_secrecy(f"ws://{host}", insecure=False)


@pytest.mark.parametrize("host", ["lab.example", "10.0.0.1:8765", "localhost.lab.example", "[::2]"])
def test_a_token_goes_to_no_other_machine_without_tls(host: str) -> None:
    with pytest.raises(SettingError, match=r"wss://, or given with --insecure"):
        check_secrecy(f"ws://{host}", insecure=False)
    with pytest.raises(SettingError):
        ClientSettings(f"ws://{host}", "left", token="a.b.c")
    check_secrecy(f"wss://{host}", insecure=False)
    assert "a.b.c" not in repr(ClientSettings(f"wss://{host}", "left", token="a.b.c"))


@pytest.mark.parametrize("token", ["a b", "a\n", "ä", "x" * 2049])
def test_a_token_that_is_not_whole_is_a_sentence_without_it(token: str) -> None:
    with pytest.raises(SettingError, match="token is not whole") as caught:
        ClientSettings("wss://lab.example", "left", token=token)
    assert token not in str(caught.value)


@given(
    st.text(max_size=60)
    | st.from_regex(r"wss?://[a-z.]{1,9}(:\d{1,4})?[/a-z?&=]{0,20}", fullmatch=True)
)
def test_what_a_websocket_asks_for_ends_with_a_slash_and_is_the_same_address(said: str) -> None:
    asked = with_slash(said)
    assert with_slash(asked) == asked
    if asked != said:  # by its parts: upper case in the scheme, or a tab, is the same to a browser
        before, after = urlsplit(said), urlsplit(asked)
        assert after == before._replace(path=f"{before.path}/")
    assert with_slash("wss://lab.example/haptics?a=b") == "wss://lab.example/haptics/?a=b"
    assert with_slash("ws://127.0.0.1:8765") == "ws://127.0.0.1:8765/"


@pytest.fixture
def proxied(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HTTP_PROXY", "NO_PROXY", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)
    monkeypatch.delenv("https_proxy", raising=False)
    monkeypatch.setenv("HTTPS_PROXY", "http://user:secret@proxy.example:3128")


@pytest.mark.usefixtures("proxied")
def test_a_proxy_is_for_public_hosts_with_tls(monkeypatch: pytest.MonkeyPatch) -> None:
    assert proxy_for("wss://lab.example/r/a") == "http://user:secret@proxy.example:3128"
    assert proxy_for("wss://8.8.8.8:8765") is not None
    near = ["localhost", "127.0.0.1", "10.1.2.3:8765", "192.168.1.4", "[::1]", "lab", "lab.local"]
    for url in (*(f"wss://{host}" for host in near), "ws://lab.example"):
        assert proxy_for(url) is None
    monkeypatch.setenv("NO_PROXY", ".example")
    assert proxy_for("wss://lab.example") is None
    monkeypatch.delenv("NO_PROXY")
    # A SOCKS proxy would need a library that is not installed.
    monkeypatch.setenv("HTTPS_PROXY", "socks5://proxy.example")
    assert proxy_for("wss://lab.example") is None


def test_a_password_of_a_proxy_is_in_no_sentence() -> None:
    words = silence("http://user:secret@proxy.example:3128")
    assert "proxy.example:3128" in words
    assert "secret" not in words
