from __future__ import annotations

import base64
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import MAX_TOKEN
from cohaptic_server.access.keys import Denied, Grants, Key, KeyRing
from cohaptic_server.access.tokens import LEEWAY, SESSION_AUDIENCE, sign, verify
from tests.server.access.some import ALL, KEY, NOW, OTHER, RING, claims, raw, said, signed, token


def refused(text: str, now: float = NOW, ring: KeyRing = RING) -> str:
    """Why a token is refused: a sentence without the token and without a secret."""
    with pytest.raises(Denied) as caught:
        verify(text, ring, now)
    words = str(caught.value)
    assert caught.value.code is CloseCode.UNAUTHENTICATED
    assert len(words) < 240
    assert words.isprintable()
    assert not any(part in words for part in text.split(".") if len(part) > 20)
    return words


def test_what_is_signed_is_read() -> None:
    assert verify(token(), RING, NOW) == claims()


@given(
    st.builds(
        Grants,
        room=st.sampled_from(["main", "lab-*", "*"]),
        room_join=st.booleans(),
        can_touch=st.booleans(),
        room_admin=st.booleans(),
        max_force=st.none() | st.floats(0.0, 100.0),
    )
)
def test_grants_come_back_as_they_were_given(grants: Grants) -> None:
    read = verify(token(grants), RING, NOW)
    assert read.haptic == grants


def test_a_token_ends_and_begins_within_the_leeway() -> None:
    ends = token(exp=NOW + 60.0)
    verify(ends, RING, NOW + 60.0 + LEEWAY - 1.0)
    assert "ended 10 s ago: ask" in refused(ends, NOW + 60.0 + LEEWAY)
    assert "ended 2 days ago" in refused(ends, NOW + 2.1 * 86400.0)
    # The next one is as old where the clock of the machine that invites is late; all of it fits
    # into the reason of a close.
    old = refused(ends, NOW + 59.0 * 86400.0)
    assert "the clock of the inviting machine is late" in old
    assert len(old.encode()) <= 123
    begins = token(nbf=NOW + 60.0)
    verify(begins, RING, NOW + 60.0 - LEEWAY)
    assert "begins in 2 minutes" in refused(token(nbf=NOW + 120.0))
    assert "begins in" in refused(token(iat=NOW + 30.0))


@pytest.mark.parametrize("name", ["exp", "iat", "iss", "sub", "aud", "jti", "haptic"])
def test_a_claim_that_is_not_there_is_named(name: str) -> None:
    assert name in refused(raw(said(**{name: None})))


def test_a_token_of_another_key_is_refused() -> None:
    assert "signature" in refused(raw(said(), OTHER.secret))
    assert "no key" in refused(token(key=OTHER))
    assert "no key" in refused(raw(said(), kid="another"))


def test_a_key_is_rotated_and_then_taken_out() -> None:
    old = token()
    both = RING.rotated(OTHER)
    verify(old, both, NOW)
    verify(token(key=OTHER), both, NOW)
    assert "no key" in refused(old, ring=KeyRing((OTHER,)))


def test_a_token_without_a_signature_is_refused() -> None:
    assert "algorithm" in refused(raw(said(), b"", "none"))
    head, body, _ = token().split(".")
    nothing = json.dumps({"alg": "none", "kid": "first"}).encode()
    forged = base64.urlsafe_b64encode(nothing).decode().rstrip("=")
    assert "algorithm" in refused(f"{forged}.{body}.")
    assert "signature" in refused(f"{head}.{body}.")


@pytest.mark.parametrize("alg", ["HS384", "HS512"])
def test_the_algorithm_is_the_keys_and_not_the_tokens(alg: str) -> None:
    # Signed with the right secret, but not as the key is used.
    assert "algorithm" in refused(raw(said(), KEY.secret * 2, alg))


@pytest.mark.parametrize("alg", ["RS256", "ES256", "EdDSA", "none", "NONE", "hs256", "", None, 7])
def test_a_header_chooses_no_algorithm(alg: object) -> None:
    _, body, mark = token().split(".")
    head = json.dumps({"alg": alg, "kid": "first"}).encode()
    forged = base64.urlsafe_b64encode(head).decode().rstrip("=")
    words = refused(f"{forged}.{body}.{mark}")
    assert "algorithm" in words or "no token" in words


def test_a_key_of_another_algorithm_takes_its_own_tokens_alone() -> None:
    long = Key("first", bytes(range(64)), "HS512")
    verify(sign(claims(), long), KeyRing((long,)), NOW)
    assert "algorithm" in refused(raw(said(), long.secret, "HS256"), ring=KeyRing((long,)))


def test_the_issuer_is_the_keys() -> None:
    lab = Key("first", KEY.secret, issuer="lab")
    verify(raw(said(iss="lab")), KeyRing((lab,)), NOW)
    assert "issuer" in refused(raw(said()), ring=KeyRing((lab,)))


@pytest.mark.parametrize("aud", ["other", ["cohaptic"], ["cohaptic", "x"], "cohaptic "])
def test_a_token_for_something_else_is_refused(aud: object) -> None:
    assert "something else" in refused(raw(said(aud=aud)))


def test_an_invitation_is_no_session_whatever_it_claims() -> None:
    session = {"sid": "x", "began": 1.0, "invitation": "y"}
    assert verify(raw(said(session=session)), RING, NOW).session is None
    assert "names none" in refused(raw(said(aud=SESSION_AUDIENCE)))
    forged = raw(said(aud=SESSION_AUDIENCE, session=session), OTHER.secret)
    assert "signature" in refused(forged)


@pytest.mark.parametrize(
    "changes",
    [
        {"sub": ""},
        {"sub": 7},
        {"sub": "a b"},
        {"sub": "ä"},
        {"sub": "x" * 65},
        {"sub": "\x1b[2J"},
        {"jti": ""},
        {"jti": 7},
        {"exp": "soon"},
        {"exp": True},
        {"exp": float("nan")},
        {"exp": float("inf")},
        {"exp": -1},
        {"exp": 10**15},
        {"iat": None, "exp": 1},
        {"haptic": []},
        {"haptic": {}},
        {"haptic": {"room": "main", "unknown": True}},
        {"haptic": {"room": "main", "canTouch": "yes"}},
    ],
)
def test_claims_that_are_not_right_are_refused(changes: dict[str, Any]) -> None:
    refused(raw(said() | changes))


def test_a_token_that_is_too_long_is_refused_before_it_is_read() -> None:
    assert f"more than {MAX_TOKEN}" in refused("eyJ" + "a" * MAX_TOKEN)
    assert f"more than {MAX_TOKEN}" in refused(raw(said(more="x" * MAX_TOKEN)))


@pytest.mark.parametrize(
    "text", ["", ".", "..", "...", "a.b", "a.b.c", "ä.b.c", "e\n", "\x00", " "]
)
def test_what_is_no_token_is_refused(text: str) -> None:
    refused(text)


def test_json_that_is_nested_as_deep_as_a_token_is_long_is_refused() -> None:
    deep = base64.urlsafe_b64encode(b"[" * 1200).decode().rstrip("=")
    refused(f"{deep}..")
    head = token().split(".")[0]
    refused(f"{head}.{deep}.")
    refused(signed(b"[" * 1200))


@given(st.text(max_size=200) | st.text(alphabet="eyJ.abcXYZ019-_=", max_size=300))
def test_rubbish_is_refused(text: str) -> None:
    with pytest.raises(Denied):
        verify(text, RING, NOW)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)


@given(st.sampled_from(sorted(said())), JSON)
def test_any_value_of_any_claim_is_a_claim_or_refused(name: str, value: object) -> None:
    payload = json.dumps(said() | {name: value}).encode()
    try:
        read = verify(signed(payload), RING, NOW)
    except Denied:
        return
    assert read.exp > NOW - LEEWAY
    assert read.sub


@given(JSON, st.sampled_from(["alg", "kid", "typ", "crit", "b64", "jku"]))
def test_any_header_is_refused_or_changes_nothing(value: object, name: str) -> None:
    _, body, mark = token().split(".")
    head = json.dumps({"alg": "HS256", "kid": "first", "typ": "JWT"} | {name: value}).encode()
    forged = base64.urlsafe_b64encode(head).decode().rstrip("=")
    try:
        read = verify(f"{forged}.{body}.{mark}", RING, NOW)
    except Denied:
        return
    assert read == claims()  # the header was what it had been


@given(st.integers(0, 500), st.integers(0, 127))
def test_no_letter_of_a_token_can_be_changed(at: int, letter: int) -> None:
    whole = token(ALL)
    at %= len(whole)
    changed = whole[:at] + chr(letter) + whole[at + 1 :]
    try:
        read = verify(changed, RING, NOW)
    except Denied:
        return
    # Of the last letter of the signature two bits mean nothing.
    assert changed == whole or at == len(whole) - 1
    assert read == claims()
