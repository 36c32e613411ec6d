from __future__ import annotations

import ssl
from pathlib import Path

import pytest
from cryptography.hazmat.primitives import serialization as forms

from cohaptic.errors import SettingError
from cohaptic_server.credentials.certificate import Certificate
from tests.server.credentials.pairs import write_authority, write_pair


def served(certificate: Certificate, ca: Path, name: str | None = "localhost") -> bytes | None:
    """The certificate that a client gets, as its bytes."""
    client = ssl.create_default_context(cafile=str(ca))
    client.check_hostname = False
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    there = client.wrap_bio(to_client, to_server, server_hostname=name)
    here = certificate.context.wrap_bio(to_server, to_client, server_side=True)
    for _ in range(4):
        for side in (there, here):
            try:
                side.do_handshake()
            except ssl.SSLWantReadError:
                continue
    return there.getpeercert(binary_form=True)


def test_what_is_loaded_is_served_and_a_new_one_from_the_next_connection_on(
    tmp_path: Path,
) -> None:
    ca = write_authority(tmp_path)
    certificate = Certificate(*write_pair(tmp_path, days=1.0))
    first = served(certificate, ca)
    assert "GMT" in certificate.ends
    write_pair(tmp_path, days=2.0)
    assert served(certificate, ca) == first
    certificate.load()
    second = served(certificate, ca)
    assert second != first
    # One that connects to an address names no host.
    assert served(certificate, ca, None) == second


def test_what_cannot_be_used_changes_nothing(tmp_path: Path) -> None:
    ca = write_authority(tmp_path)
    cert, key = write_pair(tmp_path)
    certificate = Certificate(cert, key)
    first = served(certificate, ca)
    write_pair(tmp_path, name="other-")
    key.write_bytes((tmp_path / "other-key.pem").read_bytes())
    with pytest.raises(SettingError, match=r"--tls-key is .*the key of the certificate"):
        certificate.load()
    cert.write_text("")
    with pytest.raises(SettingError, match="PEM"):
        certificate.load()
    cert.unlink()
    with pytest.raises(SettingError, match="can be read"):
        certificate.load()
    assert served(certificate, ca) == first


def test_a_pair_that_does_not_belong_together_is_a_sentence(tmp_path: Path) -> None:
    cert, _ = write_pair(tmp_path)
    _, other = write_pair(tmp_path, name="other-")
    with pytest.raises(SettingError, match=rf"{other}; it must be the key of the certificate"):
        Certificate(cert, other)


def test_a_certificate_that_has_ended_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"which has expired; it must be renewed"):
        Certificate(*write_pair(tmp_path, days=-1.0))


def test_a_key_with_a_password_is_a_sentence_and_no_question(tmp_path: Path) -> None:
    cert, key = write_pair(tmp_path)
    private = forms.load_pem_private_key(key.read_bytes(), None)
    locked = forms.BestAvailableEncryption(b"secret")
    key.write_bytes(private.private_bytes(forms.Encoding.PEM, forms.PrivateFormat.PKCS8, locked))
    with pytest.raises(SettingError, match="without a password"):
        Certificate(cert, key)


@pytest.mark.parametrize("text", ["", "nonsense", "-----BEGIN CERTIFICATE-----\nAAAA\n"])
def test_what_is_no_pair_is_a_sentence(text: str, tmp_path: Path) -> None:
    cert, key = write_pair(tmp_path)
    (tmp_path / "bad").write_text(text)
    for pair in ((tmp_path / "bad", key), (cert, tmp_path / "bad"), (tmp_path, key)):
        with pytest.raises(SettingError) as caught:
            Certificate(*pair)
        assert "\n" not in str(caught.value)


def test_no_client_gets_an_old_version_of_tls(tmp_path: Path) -> None:
    certificate = Certificate(*write_pair(tmp_path))
    assert certificate.context.minimum_version >= ssl.TLSVersion.TLSv1_2
    client = ssl.create_default_context(cafile=str(write_authority(tmp_path)))
    client.set_ciphers("DEFAULT:@SECLEVEL=0")
    with pytest.warns(DeprecationWarning, match="TLSv1"):
        client.minimum_version = ssl.TLSVersion.TLSv1
    with pytest.warns(DeprecationWarning, match="TLSv1_1"):
        client.maximum_version = ssl.TLSVersion.TLSv1_1
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    there = client.wrap_bio(to_client, to_server, server_hostname="localhost")
    here = certificate.context.wrap_bio(to_server, to_client, server_side=True)
    with pytest.raises(ssl.SSLWantReadError):
        there.do_handshake()
    with pytest.raises(ssl.SSLError, match=r"(?i)unsupported|version"):
        here.do_handshake()
