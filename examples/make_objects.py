"""Make the objects of this folder: a torus, and an organ like a liver.

    python examples/make_objects.py [--out examples]

Both are in metres, stand on z = 0 and are reproducible. The torus is in closed form; the organ is a
star-shaped implicit surface of blended lobes: its distance from the centre is found by bisection
along every direction, so that it has no hole and one component.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints

# Centre, half axes [m] and weight of each lobe; negative weights hollow the underside out.
_LOBES = (
    ((0.030, 0.000, 0.004), (0.062, 0.056, 0.046), 1.0),  # the right one, large
    ((-0.046, 0.012, 0.012), (0.056, 0.040, 0.024), 1.0),  # the left one, flat
    ((-0.002, -0.030, -0.008), (0.036, 0.026, 0.026), 0.5),  # two small ones below
    ((0.000, 0.032, -0.006), (0.034, 0.024, 0.028), 0.45),
    ((-0.022, -0.006, -0.052), (0.046, 0.044, 0.036), -0.75),  # where stomach and kidney lie
    ((-0.016, -0.058, 0.020), (0.012, 0.030, 0.050), -0.5),  # the notch between the lobes
)
_LEVEL = 0.38  # value of the sum of the lobes on the surface
_MAX_RADIUS = 0.2  # m from the centre
_SMOOTHINGS = 40  # iterations that even out the spacing of the vertices


def torus(ring: float = 0.06, tube: float = 0.025, around: int = 56, across: int = 28) -> Mesh:
    """A torus that lies on z = 0.

    Args:
        ring: Radius of the middle of the tube [m].
        tube: Radius of the tube [m].
        around: Vertices round the ring.
        across: Vertices round the tube.
    """
    u = 2.0 * np.pi * np.arange(around) / around
    v = 2.0 * np.pi * np.arange(across) / across
    out = ring + tube * np.cos(v)
    x = np.stack(
        [
            np.outer(np.cos(u), out),
            np.outer(np.sin(u), out),
            np.broadcast_to(tube * (1.0 + np.sin(v)), (around, across)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    row, next_row = i * across, (i + 1) % around * across
    next_column = (j + 1) % across
    faces = [
        (row + j, next_row + j, next_row + next_column),
        (row + j, next_row + next_column, row + next_column),
    ]
    return x, np.concatenate([np.stack(face, axis=1) for face in faces])


def organ(subdivisions: int = 4) -> Mesh:
    """Two large lobes and two small ones, flat on the left, hollow below; about 0.2 m wide."""
    direction, faces = icosphere(subdivisions, 1.0)
    neighbours = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = np.bincount(neighbours[:, 0], minlength=len(direction))[:, None]
    x = direction * _radius(direction)[:, None]
    for _ in range(_SMOOTHINGS):
        # Move each vertex to the mean of its neighbours, then back to the surface along its ray.
        middle = np.zeros_like(x)
        np.add.at(middle, neighbours[:, 0], x[neighbours[:, 1]])
        direction = 0.5 * (x + middle / count)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        x = direction * _radius(direction)[:, None]
    return x - np.array([0.0, 0.0, x[:, 2].min()]), faces


Mesh = tuple[Floats, Ints]


def _lobes(x: Floats) -> Floats:
    """Sum of the lobes at points, shape (n,)."""
    total = np.zeros(len(x))
    for center, axes, weight in _LOBES:
        off = (x - np.array(center)) / np.array(axes)
        total += weight * np.exp(-np.einsum("ni,ni->n", off, off))
    return total


def _radius(direction: Floats) -> Floats:
    """Distance of the surface from the centre in each direction, by bisection, shape (n,) [m]."""
    near, far = np.zeros(len(direction)), np.full(len(direction), _MAX_RADIUS)
    for _ in range(50):
        middle = 0.5 * (near + far)
        inside = _lobes(direction * middle[:, None]) > _LEVEL
        near, far = np.where(inside, middle, near), np.where(inside, far, middle)
    return near


def stl(mesh: Mesh) -> bytes:
    """The bytes of a binary STL file."""
    x, faces = mesh
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
    table = np.zeros(len(faces), dtype=record)
    normals = face_area_vectors(x, faces)
    table["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    table["corners"] = x[faces]
    head = b"cohaptic example, metres".ljust(80, b" ")
    return head + len(faces).to_bytes(4, "little") + table.tobytes()


def ply(mesh: Mesh) -> bytes:
    """The bytes of a binary PLY file."""
    x, faces = mesh
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        "comment cohaptic example, metres",
        f"element vertex {len(x)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    table = np.zeros(len(faces), dtype=np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    table["count"], table["corners"] = 3, faces
    return "\n".join(lines).encode() + x.astype("<f4").tobytes() + table.tobytes()


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    out: Path = parser.parse_args().out
    for name, content in (("torus.stl", stl(torus())), ("organ.ply", ply(organ()))):
        (out / name).write_bytes(content)
        print(f"{out / name}: {len(content) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
