"""Files of each kind that a server offers to take, through an upload of their own."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from cohaptic.protocol.upload_messages import Examined
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.touchable import KINDS
from tests.uploads.desk.stage_of_uploads import after_progress, begin, bring, desk_of
from tests.uploads.sound import SOUND

pytestmark = pytest.mark.live

pytest.importorskip("nibabel", reason="pip install 'cohaptic[scans]' reads scans")
pytest.importorskip("nrrd", reason="pip install 'cohaptic[scans]' reads scans")


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_that_is_offered_is_taken(kind: str, small_balloon: Balloon) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, _), bring(served.url) as ws:
            await begin(ws, SOUND[kind](), f"of the left.side{kind.upper()}")
            assert isinstance(await after_progress(ws), Examined)

    asyncio.run(happen())
