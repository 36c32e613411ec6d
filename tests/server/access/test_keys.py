from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_server.access.keys import Key, KeyRing, read_keys, write_keys
from tests.server.access.some import KEY, OTHER, RING


@given(st.lists(st.binary(min_size=64, max_size=80), min_size=1, max_size=5))
def test_what_is_written_is_read(secrets: list[bytes]) -> None:
    ring = KeyRing(tuple(Key(f"k{i}", secret, "HS512", "lab") for i, secret in enumerate(secrets)))
    assert read_keys(write_keys(ring)) == ring


def test_a_secret_is_at_least_as_long_as_its_hash() -> None:
    with pytest.raises(SettingError, match=r"key a is 31 bytes long.*at least 32"):
        Key("a", bytes(31))
    with pytest.raises(SettingError, match="at least 48"):
        Key("a", bytes(47), "HS384")


def test_keys_have_different_names_and_are_not_many() -> None:
    with pytest.raises(SettingError, match="different"):
        KeyRing((KEY, Key("first", bytes(32))))
    with pytest.raises(SettingError, match="number of keys"):
        KeyRing(())
    with pytest.raises(SettingError, match="number of keys"):
        KeyRing(tuple(Key(str(i), bytes(32)) for i in range(17)))


def test_a_new_key_signs_and_the_old_ones_are_accepted() -> None:
    ring = RING.rotated(OTHER)
    assert ring.signer is OTHER
    assert ring.find("first") is KEY
    assert RING.rotated(OTHER, keep=0).find("first") is None


SECRET = "c2VjcmV0c2VjcmV0c2VjcmV0c2VjcmV0c2VjcmV0c2VjcmV0"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"keys": []}',
        '{"keys": [{"kty": "oct"}]}',
        json.dumps({"keys": [{"kty": "RSA", "kid": "a", "k": SECRET}]}),
        json.dumps({"keys": [{"kty": "oct", "kid": "a b", "k": SECRET}]}),
        json.dumps({"keys": [{"kty": "oct", "kid": "a", "k": SECRET, "alg": "none"}]}),
        json.dumps({"keys": [{"kty": "oct", "kid": "a", "k": SECRET + "!"}]}),
        json.dumps({"keys": [{"kty": "oct", "kid": "a", "k": SECRET + "ä"}]}),
        json.dumps({"keys": [{"kty": "oct", "kid": "a", "k": SECRET[:20]}]}),
        json.dumps({"keys": [{"kty": "oct", "kid": "a", "k": SECRET}] * 2}),
    ],
)
def test_a_file_that_is_wrong_is_one_sentence_that_tells_no_secret(text: str) -> None:
    with pytest.raises(SettingError) as caught:
        read_keys(text)
    assert "\n" not in str(caught.value)
    assert SECRET[:12] not in str(caught.value)
    assert caught.value.__cause__ is None


def test_a_key_does_not_show_its_secret() -> None:
    key = Key("a", b"p4ssw0rd" * 4)
    assert "p4ss" not in repr(key)
    assert "p4ss" not in repr(KeyRing((key,)))
