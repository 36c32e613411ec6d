from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.cli.access_options import AccessOptions
from cohaptic_server.credentials.key_file import save_keys
from tests.server.access.some import NOW, RING, token

HERE = "127.0.0.1"


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    save_keys(tmp_path / "keys", RING, replace=False)
    return tmp_path / "keys"


@pytest.mark.parametrize(("said", "valid"), [("0s", 0.0), ("90m", 5400.0), ("2d", 172800.0)])
def test_a_session_ends_so_long_after_its_invitation_as_is_said(
    keys: Path, said: str, valid: float
) -> None:
    admission = AccessOptions(keys=keys, session_valid=said).protection(HERE).admission
    assert admission.ends(admission.admit(token(), "main", NOW)) == NOW + 600.0 + valid


@pytest.mark.parametrize("said", ["", "soon", "-1s", "12", "1e3s", "500d", "nan"])
def test_what_is_no_time_is_a_sentence(keys: Path, said: str) -> None:
    with pytest.raises(SettingError, match=r"--session-valid.*from 0s to 400d"):
        AccessOptions(keys=keys, session_valid=said).protection(HERE)
