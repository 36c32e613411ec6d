"""Access by tokens: the keys that sign tokens, the grants in tokens, and the error `Denied`.

The keys form a JWK set (RFC 7517): tokens of all keys are accepted, and the first key signs. To
rotate keys, the owner puts a new key in front, and removes the old key after its tokens have
expired.

The grants of a token are for one room and form one object among its claims (the form that LiveKit
uses). A token allows only the actions that it states. An unknown name is an error and is not
ignored, since otherwise a misspelt limit would have no effect. `Denied` refuses entry to a client,
or an action that the client's grants do not allow.
"""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.alias_generators import to_camel

from cohaptic.errors import CloseCode, RemoteProtocolError, SettingError

Algorithm = Literal["HS256", "HS384", "HS512"]
LEAST_BYTES = 32  # length of a secret: as long as the hash of HS256 (RFC 7518, 3.2)
MAX_KEYS = 16  # more than any owner needs for rotation
ISSUER = "cohaptic"  # issuer of a key that names no other issuer
_LEAST: dict[Algorithm, int] = {"HS256": LEAST_BYTES, "HS384": 48, "HS512": 64}


class _Jwk(BaseModel):
    """A symmetric key; further members, which the standard allows, are ignored."""

    model_config = ConfigDict(extra="ignore", hide_input_in_errors=True)

    kty: Literal["oct"]
    kid: str = Field(min_length=1, max_length=64, pattern=r"^[!-~]+$")
    k: str = Field(repr=False)
    alg: Algorithm = "HS256"
    iss: str = Field(default=ISSUER, min_length=1, max_length=64)


class _JwkSet(BaseModel):
    model_config = ConfigDict(extra="ignore", hide_input_in_errors=True)

    keys: list[_Jwk] = Field(min_length=1, max_length=MAX_KEYS)


@dataclass(frozen=True, slots=True)
class Key:
    """One key that signs and verifies tokens.

    Args:
        kid: Name of the key, which tokens carry.
        secret: Secret, at least as long as the hash of the algorithm.
        algorithm: The only algorithm that may be used with the key, whatever a token says.
        issuer: Name of the issuer that signs with the key.

    Raises:
        SettingError: The secret is too short.
    """

    kid: str
    secret: bytes = field(repr=False)
    algorithm: Algorithm = "HS256"
    issuer: str = ISSUER

    def __post_init__(self) -> None:
        least = _LEAST[self.algorithm]
        if len(self.secret) < least:
            held = f"{len(self.secret)} bytes long"
            raise SettingError(f"secret of key {self.kid}", held, f"at least {least} bytes long")


@dataclass(frozen=True, slots=True)
class KeyRing:
    """All keys of a server.

    Args:
        keys: Accepted keys; the first key signs.

    Raises:
        SettingError: There is no key, there are more than `MAX_KEYS`, or two keys have one name.
    """

    keys: tuple[Key, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.keys) <= MAX_KEYS:
            raise SettingError("number of keys", len(self.keys), f"from 1 to {MAX_KEYS}")
        names = [key.kid for key in self.keys]
        for name in names:
            if names.count(name) > 1:
                raise SettingError("name of a key", repr(name), "different from all others")

    @property
    def signer(self) -> Key:
        """Key that signs new tokens."""
        return self.keys[0]

    def find(self, kid: str) -> Key | None:
        """Return the key of this name; None if there is no such key."""
        return next((key for key in self.keys if key.kid == kid), None)

    def rotated(self, key: Key, keep: int = MAX_KEYS - 1) -> KeyRing:
        """Return a key ring with a new key in front of the newest `keep` of the present keys."""
        return KeyRing((key, *self.keys[:keep]))


def read_keys(text: str | bytes) -> KeyRing:
    """Read a key ring from the text of a JWK set.

    Raises:
        SettingError: The text is no JWK set, or a key cannot be used; the error shows no secret.
    """
    try:
        found = _JwkSet.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "the whole of it"
        limit = "a JWK set, as `cohaptic key FILE` writes it"
        raise SettingError("key file", f"wrong at {where} ({first['msg']})", limit) from None
    return KeyRing(tuple(Key(key.kid, _bytes(key), key.alg, key.iss) for key in found.keys))


def write_keys(ring: KeyRing) -> str:
    """Return a key ring as the text of a JWK set, for a file that only its owner may read."""
    return (
        _JwkSet(
            keys=[
                _Jwk(
                    kty="oct",
                    kid=key.kid,
                    k=base64.urlsafe_b64encode(key.secret).decode().rstrip("="),
                    alg=key.algorithm,
                    iss=key.issuer,
                )
                for key in ring.keys
            ]
        ).model_dump_json(indent=2)
        + "\n"
    )


def _bytes(key: _Jwk) -> bytes:
    try:
        padded = key.k + "=" * (-len(key.k) % 4)
        return base64.b64decode(padded.encode("ascii"), altchars=b"-_", validate=True)
    except (binascii.Error, UnicodeEncodeError):
        limit = "base64url, as `cohaptic key FILE` writes it"
        raise SettingError(f"secret of key {key.kid}", "no text of bytes", limit) from None


ASK = "ask the owner of the room for a new invitation"


class Denied(RemoteProtocolError):
    """Refusal with a reason and advice; its text contains neither the token nor a secret.

    Args:
        problem: Reason of the refusal.
        advice: Action that the person can take.
        code: `UNAUTHENTICATED` if the client is unknown, `FORBIDDEN` if the client is known but
            lacks the right.
    """

    def __init__(
        self, problem: str, advice: str = ASK, code: CloseCode = CloseCode.UNAUTHENTICATED
    ) -> None:
        super().__init__("token", problem, advice, code)

    def __str__(self) -> str:
        return f"{self.value}: {self.limit}"


def forbidden(problem: str, advice: str = ASK) -> Denied:
    """Return the error that refuses a client who is known but lacks the right."""
    return Denied(problem, advice, CloseCode.FORBIDDEN)


MAX_ROOM = 64  # characters of a name
ROOM_NAME = r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
_PATTERN = r"^(\*|[A-Za-z0-9][A-Za-z0-9._-]{0,63}\*?)$"


class Grants(BaseModel):
    """Grants of one token; in the token the names are in camel case, such as `roomJoin`.

    Args:
        room: Name of the room, or a prefix and a star for all rooms that begin so: `lab-*`.
        room_join: Right to come in at all.
        can_touch: Right to touch the object.
        can_view: Right to watch the scene.
        room_create: Right to make rooms.
        room_admin: Right to mute, remove and ban users, and to freeze and reset the object.
        room_record: Right to record the actions of other users.
        can_inject_latency: Right to inject latency, if the server allows it.
        max_force: Limit on this user's force on the body [N]; None for no limit.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        alias_generator=to_camel,
        populate_by_name=True,
    )

    room: Annotated[str, Field(pattern=_PATTERN, max_length=MAX_ROOM + 1)]
    room_join: bool = False
    can_touch: bool = False
    can_view: bool = False
    room_create: bool = False
    room_admin: bool = False
    room_record: bool = False
    can_inject_latency: bool = False
    max_force: Annotated[float, Field(ge=0.0, le=100.0)] | None = None

    @property
    def may_record(self) -> bool:
        """Whether the token lets its owner record everybody in the room."""
        return self.room_record or self.room_admin

    def hold_in(self, room: str) -> bool:
        """Check whether the grants apply to a room of this name."""
        if self.room.endswith("*"):
            return room.startswith(self.room[:-1])
        return room == self.room


# Grants of everybody on an open server. The owner's option decides whether latency may be injected,
# and nobody administers a room without a proven identity.
OPEN = Grants(room="*", room_join=True, can_touch=True, can_view=True, can_inject_latency=True)
