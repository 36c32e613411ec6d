"""Keys that sign tokens: several are accepted, the first signs; as a JWK set (RFC 7517).

To rotate, a new key is put in front, and the old one is taken out once its tokens have ended.
"""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass, field
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cohaptic.errors import SettingError

Algorithm = Literal["HS256", "HS384", "HS512"]
LEAST_BYTES = 32  # of a secret: as long as the hash of HS256 (RFC 7518, 3.2)
MOST_KEYS = 16  # more than anybody rotates through
ISSUER = "cohaptic"  # who signs, unless the key says otherwise
_LEAST: dict[Algorithm, int] = {"HS256": LEAST_BYTES, "HS384": 48, "HS512": 64}


class _Jwk(BaseModel):
    """A symmetric key; further members, which the standard allows, are passed over."""

    model_config = ConfigDict(extra="ignore", hide_input_in_errors=True)

    kty: Literal["oct"]
    kid: str = Field(min_length=1, max_length=64, pattern=r"^[!-~]+$")
    k: str = Field(repr=False)
    alg: Algorithm = "HS256"
    iss: str = Field(default=ISSUER, min_length=1, max_length=64)


class _JwkSet(BaseModel):
    model_config = ConfigDict(extra="ignore", hide_input_in_errors=True)

    keys: list[_Jwk] = Field(min_length=1, max_length=MOST_KEYS)


@dataclass(frozen=True, slots=True)
class Key:
    """One key.

    Args:
        kid: Its name, which tokens carry.
        secret: At least as long as the hash of its algorithm.
        algorithm: The only one that it is used with, whatever a token says.
        issuer: Who signs with it.

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
        keys: Accepted ones; the first signs.

    Raises:
        SettingError: There is none, or two have one name.
    """

    keys: tuple[Key, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.keys) <= MOST_KEYS:
            raise SettingError("number of keys", len(self.keys), f"from 1 to {MOST_KEYS}")
        names = [key.kid for key in self.keys]
        for name in names:
            if names.count(name) > 1:
                raise SettingError("name of a key", repr(name), "different from all others")

    @property
    def signer(self) -> Key:
        """The key that signs."""
        return self.keys[0]

    def find(self, kid: str) -> Key | None:
        """The key of this name; None if there is none."""
        return next((key for key in self.keys if key.kid == kid), None)

    def rotated(self, key: Key, keep: int = MOST_KEYS - 1) -> KeyRing:
        """With another key in front, and of those before the newest `keep`."""
        return KeyRing((key, *self.keys[:keep]))


def read_keys(text: str | bytes) -> KeyRing:
    """The keys of a JWK set.

    Raises:
        SettingError: It is none, or a key cannot be used; the error tells no secret.
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
    """The JWK set of keys, for a file that only its owner may read."""
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
