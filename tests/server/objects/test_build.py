from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic_server.bodies.solid import parts, shape, solid
from cohaptic_server.bodies.solid.shape import Moduli, SolidSettings, SolidShape
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store import store
from cohaptic_server.testing.blocks import block

meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")


def test_a_build_makes_the_shape_once_with_an_empty_store_and_with_a_full_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nodes, surface, contact radius and the trees behind them take longer than a warm start."""
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    shapes: list[SolidShape] = []

    def shape_of(
        tets: TetMesh,
        fixed: npt.NDArray[np.bool_],
        settings: SolidSettings,
        moduli: Moduli | None = None,
    ) -> SolidShape:
        shapes.append(shape.shape_of(tets, fixed, settings, moduli))
        return shapes[-1]

    for module in (parts, solid, store):
        monkeypatch.setattr(module, "shape_of", shape_of)
    mesh, path = block((0.1, 0.1, 0.1), (2, 2, 2)), tmp_path / "cube.vtk"
    meshio.Mesh(mesh.vertices, [("tetra", mesh.tets)]).write(path)
    source = ObjectFile(path, "z <= 0%", material=SolidSettings(order=1))
    for starts in (1, 2):
        built = build(source)
        assert len(shapes) == starts
        assert built.solid.shape is shapes[-1]
