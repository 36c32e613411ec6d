from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is found in the user's store, and nothing is left in it."""
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
