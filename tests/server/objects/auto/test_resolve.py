from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.objects import cost
from cohaptic_server.objects.auto import resolve as module
from cohaptic_server.objects.auto.resolve import resolve
from cohaptic_server.objects.build import build, expected_cost
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.store import load_or_prepare
from tests.server.objects.files import write

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")


def bowl(path: Path) -> Path:
    """Half a ball of 120 units, open."""
    x, faces = icosphere(2, 60.0)
    return write(path, x, faces[x[faces].mean(axis=1)[:, 2] < 0.0])


@pytest.mark.live
def test_a_bowl_in_millimetres_becomes_a_shell_that_can_be_touched(tmp_path: Path) -> None:
    found = resolve(ObjectFile(bowl(tmp_path / "bowl.stl"), edge=0.1))
    assert found.options.split()[::2][:2] == ["--scale", "--shell"]
    made = build(found.source)
    thickness = found.source.shell
    assert made.prepared.tets.volume == pytest.approx(2 * np.pi * 0.06**2 * thickness, rel=0.1)
    assert made.solid.shape.fixed.any()


@pytest.mark.live
@pytest.mark.night
def test_a_mesh_is_made_as_coarse_as_memory_asks_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = 0.499e9  # bytes; a small object then has the last two megabytes
    monkeypatch.setattr(cost, "_PROGRAM", program)
    monkeypatch.setattr(cost, "_PRESSING", 0.0)
    path = write(tmp_path / "ball.stl", *icosphere(3, 0.05))
    source = ObjectFile(path, "z < 10%", max_memory=program + 8e6)
    assert expected_cost(source, load_or_prepare(source)).memory > source.max_memory
    found = resolve(source)
    assert found.source.edge > source.edge
    assert found.remedies[-1].option == f"--edge {found.source.edge:g}"
    coarse = load_or_prepare(found.source)
    assert expected_cost(found.source, coarse).memory <= source.max_memory
    with pytest.raises(BodyError, match="no mesh of it fits into"):
        resolve(replace(source, max_memory=program + 1e6))


def test_a_slip_in_a_rule_is_told_before_filling(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "ball.stl", *icosphere(3, 0.05))

    def fill(*_: object, **__: object) -> None:
        raise AssertionError("it was filled")

    monkeypatch.setattr(module, "load_or_prepare", fill)
    for rule in ("z > 3m", "q < 10%"):
        with pytest.raises(SettingError, match="--fix"):
            resolve(ObjectFile(path, rule))


@pytest.mark.live
def test_parts_that_do_not_touch_are_refused_in_a_sentence(tmp_path: Path) -> None:
    x, faces = icosphere(2, 0.02)
    both = np.concatenate([x, x + np.array([0.1, 0.0, 0.0])])
    path = write(tmp_path / "two.stl", both, np.concatenate([faces, faces + len(x)]))
    with pytest.raises(BodyError, match=r"two.stl: the solid is in 2 pieces.*join them"):
        resolve(ObjectFile(path, edge=0.15))
