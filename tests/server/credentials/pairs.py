"""Certificates for the tests, of an authority of their own."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import trustme

AUTHORITY = trustme.CA()
NOW = datetime.now(UTC)


def write_authority(folder: Path) -> Path:
    """The certificate that vouches for those of `write_pair`."""
    path = folder / "ca.pem"
    AUTHORITY.cert_pem.write_to_path(path)
    return path


def write_pair(folder: Path, *hosts: str, days: float = 1.0, name: str = "") -> tuple[Path, Path]:
    """A certificate for these hosts and its key.

    Args:
        folder: Where they are written.
        hosts: Names and addresses.
        days: Until it ends; negative for one that has.
        name: That the files begin with.
    """
    pair = AUTHORITY.issue_cert(
        *(hosts or ("127.0.0.1", "localhost")), not_after=NOW + timedelta(days=days)
    )
    cert, key = folder / f"{name}cert.pem", folder / f"{name}key.pem"
    cert.write_bytes(b"".join(part.bytes() for part in pair.cert_chain_pems))
    pair.private_key_pem.write_to_path(key)
    return cert, key
