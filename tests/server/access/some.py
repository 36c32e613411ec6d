"""Keys, claims and tokens for the tests."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import jwt

from cohaptic_server.access.admission import Admission
from cohaptic_server.access.keys import Grants, Key, KeyRing
from cohaptic_server.access.tokens import Claims, sign

NOW = 1_800_000_000.0  # Unix time [s]
KEY = Key("first", bytes(range(32)))
OTHER = Key("second", bytes(range(1, 33)))
RING = KeyRing((KEY,))
ALL = Grants(room="main", room_join=True, can_touch=True, can_view=True)


def claims(grants: Grants = ALL, **changes: Any) -> Claims:
    """Of an invitation that was just made."""
    said: dict[str, Any] = {"sub": "anna", "jti": "one", "iat": NOW, "exp": NOW + 600.0}
    return Claims(haptic=grants, **said | changes)


def token(grants: Grants = ALL, key: Key = KEY, **changes: Any) -> str:
    """The same, signed."""
    return sign(claims(grants, **changes), key)


def said(**changes: Any) -> dict[str, Any]:
    """The claims as another library would write them; None leaves one out."""
    whole: dict[str, Any] = {
        "sub": "anna",
        "jti": "one",
        "iat": int(NOW),
        "exp": int(NOW) + 600,
        "iss": "cohaptic",
        "aud": "cohaptic",
        "haptic": {"room": "main", "roomJoin": True},
    } | changes
    return {name: value for name, value in whole.items() if value is not None}


def raw(payload: dict[str, Any], key: bytes = KEY.secret, alg: str = "HS256", **head: Any) -> str:
    """A token of anything."""
    encode: Any = getattr(jwt, "encode")  # noqa: B009
    return str(encode(payload, key or None, algorithm=alg, headers={"kid": "first"} | head))


def signed(payload: bytes) -> str:
    """A token with the right signature of any bytes."""
    encode: Any = getattr(jwt.api_jws, "encode")  # noqa: B009
    return str(encode(payload, KEY.secret, "HS256", {"kid": "first"}))


def drawn() -> Callable[[], str]:
    """Names, each another."""
    numbers = itertools.count(1)
    return lambda: f"name-{next(numbers):012d}"


def admission(
    ring: KeyRing | None = RING,
    *,
    admits_anybody: bool = False,
    single_use: bool = False,
    session_valid: float | None = None,
) -> Admission:
    """Of a server that takes in nobody without a token."""
    return Admission(
        ring,
        admits_anybody=admits_anybody,
        single_use=single_use,
        session_valid=session_valid,
        draw=drawn(),
    )
