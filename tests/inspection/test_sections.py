from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cohaptic_server.objects.parts.parts import Parts
from cohaptic_server.testing.blocks import block
from cohaptic_tools.inspection.sections import draw_sections, section

BLOCK = block((0.1, 0.08, 0.06), (4, 3, 3))


@pytest.mark.parametrize(("axis", "area"), [(0, 0.08 * 0.06), (1, 0.1 * 0.06), (2, 0.1 * 0.08)])
def test_a_section_covers_the_object_once(axis: int, area: float) -> None:
    polygons, owners = section(BLOCK, axis, float(BLOCK.vertices[:, axis].mean()) + 1e-4)
    assert len(polygons) == len(owners)
    total = 0.0
    for polygon in polygons:
        a, b = (np.delete(p, axis, axis=1) for p in (polygon, np.roll(polygon, -1, axis=0)))
        total += 0.5 * abs(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()))
    assert total == pytest.approx(area)


def test_a_picture_is_written(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    upper = BLOCK.vertices[BLOCK.tets].mean(axis=1)[:, 2] > 0.03
    parts = Parts(("soft", "hard"), upper.astype(np.int64))
    draw_sections(tmp_path / "a.png", BLOCK, parts, ["soft: 1", "hard: 2"], title="block")
    assert (tmp_path / "a.png").stat().st_size > 10_000
