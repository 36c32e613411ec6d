"""Rubber on meshes that fTetWild made once, since it makes none twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.mesh.tetrahedra import TetMesh

_DATA = Path(__file__).with_name("data")


def kept_rubber(name: str) -> RubberSolid:
    """The solid of `data/NAME.npz`: vertices [m], tetrahedra and which vertices are held."""
    kept = np.load(_DATA / f"{name}.npz")
    tets = TetMesh.checked(kept["vertices"].astype(np.float64), kept["tets"].astype(np.int64))
    return RubberSolid(tets, kept["fixed"], SolidSettings())
