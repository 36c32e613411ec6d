"""Makes and verifies signed tokens: JWT (RFC 7519) with grants. The time is an argument.

The key alone determines the algorithm, whatever the token says, and a token must have all claims of
a fixed list. A token states an identity (`sub`), an end (`exp`) and grants (`haptic`). Verification
takes about 0.1 ms of processor time for any token, since the length is bounded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import jwt
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cohaptic.protocol.messages import MAX_TOKEN
from cohaptic_server.access.keys import Denied, Grants, Key, KeyRing

AUDIENCE = "cohaptic"  # scene broadcast of an invitation
SESSION_AUDIENCE = "cohaptic-session"  # scene broadcast of a token with which a client comes back
LEEWAY = 10.0  # s by which the clocks of two machines may differ
# The library's types refer to types of `cryptography`, which these algorithms do not need.
_encode: Callable[..., str] = getattr(jwt, "encode")  # noqa: B009
_decode: Callable[..., dict[str, Any]] = getattr(jwt, "decode")  # noqa: B009
_REQUIRED = ["exp", "iat", "iss", "sub", "aud", "jti"]
# The library would read the machine's clock; `_check_times` checks the times instead.
_OPTIONS: Any = {
    "require": _REQUIRED,
    "verify_signature": True,
    "verify_aud": True,
    "verify_iss": True,
    "verify_sub": True,
    "verify_jti": True,
    "verify_exp": False,
    "verify_nbf": False,
    "verify_iat": False,
    "enforce_minimum_key_length": True,
}
_WRONG = "open the whole link, or copy the whole token"

Text = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[!-~]+$")]
Time = Annotated[float, Field(ge=0.0, le=1e12)]


class Session(BaseModel):
    """Name and times of a session, as a session token states them.

    Args:
        sid: Name of the session.
        began: Time at which the session began, Unix time [s].
        invitation: Name (`jti`) of the invitation that began the session.
        until: End of that invitation, Unix time [s]; None in a token of an earlier version.
    """

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True, allow_inf_nan=False)

    sid: Text
    began: Time
    invitation: Text
    until: Time | None = None


class Claims(BaseModel):
    """Claims of a token; claims for other services are ignored.

    Args:
        sub: Identity of the person to whom the token was issued.
        jti: Name of this token.
        iat: Time at which the token was made, Unix time [s].
        exp: Time at which the token expires, Unix time [s].
        nbf: Time from which the token is valid, Unix time [s]; None if it is valid at once.
        haptic: Grants of the token.
        session: Session that the token continues; None for an invitation.
    """

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True, allow_inf_nan=False)

    sub: Text
    jti: Text
    iat: Time
    exp: Time
    nbf: Time | None = None
    haptic: Grants
    session: Session | None = None


def sign(claims: Claims, key: Key, audience: str = AUDIENCE) -> str:
    """Sign a token with these claims, and return it as text."""
    said: dict[str, Any] = claims.model_dump(exclude_none=True, exclude={"haptic"})
    said |= {"iss": key.issuer, "aud": audience, "iat": int(claims.iat), "exp": int(claims.exp)}
    said["haptic"] = claims.haptic.model_dump(by_alias=True, exclude_defaults=True)
    return _encode(said, key.secret, algorithm=key.algorithm, headers={"kid": key.kid})


def verify(token: str, ring: KeyRing, now: float) -> Claims:
    """Verify a token and return its claims; `session` is set only for a session token.

    Args:
        token: Token from an untrusted client.
        ring: Accepted keys.
        now: Unix time [s].

    Raises:
        Denied: No key of the ring signed the token, or the token is incomplete or not valid now.
    """
    if len(token) > MAX_TOKEN:
        raise Denied(f"the token has {len(token)} characters, more than {MAX_TOKEN}", _WRONG)
    if not token.isascii() or not token.isprintable() or " " in token:
        raise Denied("the token has characters that no token has", _WRONG)
    key = _key_of(_header(token), ring)
    said = _payload(token, key)
    is_session = said.get("aud") == SESSION_AUDIENCE
    try:
        claims = Claims.model_validate(said)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])[:60]
        raise Denied(f"the claim {where} of the token is not right ({first['msg']})") from None
    _check_times(claims, now)
    if is_session and claims.session is None:
        raise Denied("the token of a session names none")
    # An invitation must not bring its own session, so its `session` claim is dropped.
    return claims if is_session else claims.model_copy(update={"session": None})


def _header(token: str) -> Mapping[str, Any]:
    try:
        return jwt.get_unverified_header(token)
    # RecursionError: a token has room for JSON that is nested a thousand times.
    except (jwt.InvalidTokenError, ValueError, TypeError, RecursionError):
        raise Denied("this is no token", _WRONG) from None


def _key_of(header: Mapping[str, Any], ring: KeyRing) -> Key:
    kid = header.get("kid")
    key = ring.find(kid) if isinstance(kid, str) else None
    if key is None:
        raise Denied("the token names no key that this server has: it is for another, or too old")
    if header.get("alg") != key.algorithm:
        raise Denied("the token names another algorithm than its key's")
    return key


def _payload(token: str, key: Key) -> dict[str, Any]:
    try:
        said = _decode(
            token,
            key.secret,
            algorithms=[key.algorithm],
            audience=[AUDIENCE, SESSION_AUDIENCE],
            issuer=key.issuer,
            options=_OPTIONS,
        )
    except jwt.InvalidSignatureError:
        raise Denied("the signature of the token is not its key's") from None
    except jwt.MissingRequiredClaimError as error:
        raise Denied(f"the token lacks the claim {error.claim}") from None
    except jwt.InvalidIssuerError:
        raise Denied("the token is from another issuer than its key's") from None
    except jwt.InvalidAudienceError:
        raise Denied("the token is for something else than cohaptic") from None
    except (jwt.InvalidTokenError, ValueError, TypeError, RecursionError):
        raise Denied("this is no token", _WRONG) from None
    if said["aud"] not in (AUDIENCE, SESSION_AUDIENCE):
        raise Denied("the token is for something else beside cohaptic")
    return said


# Short enough for the reason of a close, 123 bytes.
_OLD = "ask for a new invitation; if that is old too, the clock of the inviting machine is late"


def _check_times(claims: Claims, now: float) -> None:
    if now >= claims.exp + LEEWAY:
        raise Denied(f"the token ended {_ago(now - claims.exp)} ago", _OLD)
    begins = max(claims.iat, claims.nbf or 0.0)
    if now < begins - LEEWAY:
        wait = "wait, or set the clocks of both machines"
        raise Denied(f"the token begins in {_ago(begins - now)}", wait)


def _ago(seconds: float) -> str:
    for unit, size in (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"
