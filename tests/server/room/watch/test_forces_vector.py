"""The surface from forces, as a second language makes it: an example with everything that it needs.

`python -m tests.server.room.watch.test_forces_vector` writes it again.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.green import decode_block, encode_block, green_source
from cohaptic_server.mesh.surface import FINE, SurfaceMesh, pressure
from cohaptic_server.numeric import Floats, Ints

FILE = Path(__file__).parents[3] / "vectors" / "forces.json"
# Of two sizes, and with a radius below the mesh's resolution.
CONTACTS: list[dict[str, Any]] = [
    {
        "radius": 0.03,
        "foot": [0.09, 0.02, 0.03],
        "normal": [0.928, 0.206, 0.309],
        "force": [2.0, 0.5, -0.25],
    },
    {"radius": 0.02, "foot": [0.0, 0.0, 0.1], "normal": [0.0, 0.0, 1.0], "force": [0.0, 0.0, 1.5]},
    {
        "radius": 0.002,
        "foot": [-0.07, 0.05, -0.03],
        "normal": [-0.768, 0.549, -0.329],
        "force": [-1.0, 1.0, 0.0],
    },
]
# On a mesh of more faces, which is not written but made: a ring of squares cut in two.
RING = {"along": 72, "round": 72, "radius": 0.08, "tube": 0.03}
ON_RING: list[dict[str, Any]] = [
    {"radius": 0.01, "foot": [0.11, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]},
    {"radius": 0.0004, "foot": [0.001, 0.0815, 0.0298], "normal": [0.0, 0.0, 1.0]},
    # It reaches round the tube, whose far side is not pressed.
    {"radius": 0.058, "foot": [0.11, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]},
]


def ring(along: int, around: int, radius: float, tube: float) -> tuple[Floats, Ints]:
    """Vertices (along around, 3) and faces (2 along around, 3) of a ring, as the page makes it."""
    i, j = (k.ravel() for k in np.mgrid[:along, :around])
    u, v = 2 * np.pi * i / along, 2 * np.pi * j / around
    out = radius + tube * np.cos(v)
    vertices = np.stack([out * np.cos(u), out * np.sin(u), tube * np.sin(v)], axis=1)
    a, b = i * around + j, (i + 1) % along * around + j
    c, d = (i + 1) % along * around + (j + 1) % around, i * around + (j + 1) % around
    return vertices, np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3).astype(np.int64)


def on_ring() -> dict[str, Any]:
    """Weights of contacts on a fine mesh."""
    along, around = int(RING["along"]), int(RING["round"])
    vertices, faces = ring(along, around, RING["radius"], RING["tube"])
    assert len(faces) > FINE
    mesh = SurfaceMesh(vertices, faces)
    contacts: list[dict[str, Any]] = []
    for contact in ON_RING:
        under, weights = _pressed(mesh, contact)
        contacts.append(contact | {"vertices": under.tolist(), "weights": weights.tolist()})
    return RING | {"contacts": contacts}


def _pressed(mesh: SurfaceMesh, contact: dict[str, Any]) -> tuple[Ints, Floats]:
    foot, normal = np.array(contact["foot"]), np.array(contact["normal"])
    return pressure(mesh, foot, contact["radius"], normal)


def vector() -> dict[str, Any]:
    """A coarse balloon, contacts on it, their weights, the blocks under them, the surface."""
    balloon = Balloon(BalloonSettings(subdivisions=2))
    source = green_source(balloon)
    assert source is not None
    contacts: list[dict[str, Any]] = []
    blocks: dict[int, str] = {}
    whole = np.zeros_like(balloon.mesh.vertices)
    for contact in CONTACTS:
        force = np.array(contact["force"])
        vertices, weights = _pressed(balloon.mesh, contact)
        size = float(np.linalg.norm(force))
        load = Load(vertices, weights, -force / size, size)
        whole += balloon.respond([load]).displacement
        contacts.append(contact | {"vertices": vertices.tolist(), "weights": weights.tolist()})
        for vertex in vertices.tolist():
            blocks[vertex] = encode_block(source.green(vertex)).hex()
    return {
        "vertices": np.round(balloon.mesh.vertices, 9).tolist(),
        "faces": balloon.mesh.faces.tolist(),
        "contacts": contacts,
        "blocks": {str(vertex): blocks[vertex] for vertex in sorted(blocks)},
        "displacement": np.round(whole, 9).tolist(),
        "ring": on_ring(),
    }


@pytest.fixture(scope="module")
def written() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(FILE.read_text())
    return found


def test_the_written_example_is_ours(written: dict[str, Any]) -> None:
    mine = vector()
    assert written["faces"] == mine["faces"]
    for key in ("vertices", "displacement"):
        assert np.allclose(written[key], mine[key], rtol=0.0, atol=2e-9)
    pairs = [*zip(written["contacts"], mine["contacts"], strict=True)]
    pairs += zip(written["ring"]["contacts"], mine["ring"]["contacts"], strict=True)
    for theirs, ours in pairs:
        assert theirs["vertices"] == ours["vertices"]
        assert np.allclose(theirs["weights"], ours["weights"], rtol=0.0, atol=1e-9)
    for vertex, block in written["blocks"].items():
        got = decode_block(bytes.fromhex(block))
        want = decode_block(bytes.fromhex(mine["blocks"][vertex]))
        assert np.abs(got - want).max() <= 1e-4 * np.abs(want).max()


def test_the_pages_rule_gives_the_displacement_from_blocks_and_forces(
    written: dict[str, Any],
) -> None:
    """The sum of `docs/protocol.md` from what is written alone, within 0.1 %."""
    want = np.array(written["displacement"])
    got = np.zeros_like(want)
    for contact in written["contacts"]:
        for vertex, weight in zip(contact["vertices"], contact["weights"], strict=True):
            block = decode_block(bytes.fromhex(written["blocks"][str(vertex)]))
            got -= weight * np.tensordot(np.array(contact["force"]), block, axes=1)
    assert np.abs(got - want).max() <= 1e-3 * np.abs(want).max()


def test_the_pages_rule_of_the_pressure_gives_the_weights(written: dict[str, Any]) -> None:
    """Point by point, as the protocol's page says it."""
    fractions = [((i + 1 / 3) / 3, (j + 1 / 3) / 3) for i in range(3) for j in range(3 - i)]
    fractions += [((i + 2 / 3) / 3, (j + 2 / 3) / 3) for i in range(3) for j in range(2 - i)]
    assert len(fractions) == 9
    check_weights(np.array(written["vertices"]), written["faces"], written["contacts"], fractions)


def check_weights(
    x: Floats,
    faces: list[list[int]],
    contacts: list[dict[str, Any]],
    fractions: list[tuple[float, float]],
) -> None:
    """Weights of contacts with these points on each face."""
    for contact in contacts:
        foot = np.array(contact["foot"])
        points: list[tuple[float, float, list[int], tuple[float, float, float]]] = []
        for face in faces:
            a, b, c = x[face]
            vector = np.cross(b - a, c - a)
            area = 0.5 * float(np.linalg.norm(vector))
            facing = float(vector @ np.array(contact["normal"])) / (2.0 * area)
            for s, t in fractions:
                far = float(np.linalg.norm(s * a + t * b + (1 - s - t) * c - foot))
                side = max(0.0, min(1.0, 1.0 + 2.0 * facing))
                part = side * max(1.0 - (far / contact["radius"]) ** 2, 1e-12)
                points.append((far, part * area / len(fractions), face, (s, t, 1 - s - t)))
        under = [p for p in points if p[0] <= contact["radius"] and p[1] > 0.0] or [min(points)]
        got = np.zeros(len(x))
        for _, count, face, coordinates in under:
            got[face] += count * np.array(coordinates)
        got /= got.sum()
        assert np.flatnonzero(got).tolist() == contact["vertices"]
        assert np.allclose(got[contact["vertices"]], contact["weights"], rtol=0.0, atol=1e-6)


if __name__ == "__main__":
    FILE.write_text(json.dumps(vector()) + "\n")
