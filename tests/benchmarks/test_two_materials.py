"""Objects of two materials from files agree with closed solutions."""

from __future__ import annotations

from pathlib import Path

import pytest

import closed_solutions
import two_materials
from closed_forms import Hooke, cantilever

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")


@pytest.mark.night
@pytest.mark.live
@pytest.mark.parametrize(("case", "edge"), [("series", 0.05), ("layers", 0.03)])
def test_a_file_of_two_materials_agrees(
    case: str, edge: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    row = closed_solutions.run(case, edge, tmp_path, two_materials.CASES)
    assert abs(float(row["error"] or 1.0)) < 0.03


def test_a_layered_beam_of_one_material_is_timoshenkos(monkeypatch: pytest.MonkeyPatch) -> None:
    one = Hooke(1e5, 0.3)
    monkeypatch.setattr(two_materials, "SOFT", one)
    monkeypatch.setattr(two_materials, "STIFF", one)
    whole = cantilever(one, 0.17, two_materials.BAR[2])
    assert two_materials.layered_beam() == pytest.approx(whole, rel=1e-6)
