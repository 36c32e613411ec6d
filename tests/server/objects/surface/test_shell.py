from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.checks import examine
from cohaptic_server.objects.surface.shell import SHEET, openness, thicken


def grid(n: int = 5, width: float = 1.0) -> tuple[Floats, Ints]:
    """A flat square sheet of n x n vertices in z = 0, facing upwards."""
    along = np.linspace(0.0, width, n)
    x = np.array([[a, b, 0.0] for a in along for b in along])
    number = np.arange(n * n).reshape(n, n)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = [np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]
    return x, np.concatenate([face.reshape(-1, 3) for face in faces])


def cap_of_sphere(height: float) -> tuple[Floats, Ints]:
    """The part of a unit sphere below a height, with the vertices that it uses."""
    x, faces = icosphere(3, 1.0)
    kept = faces[x[faces].mean(axis=1)[:, 2] < height]
    used, renamed = np.unique(kept, return_inverse=True)
    return x[used], renamed.reshape(-1, 3)


def test_openness_is_the_area_of_the_holes_over_that_of_the_surface() -> None:
    assert openness(*grid()) == pytest.approx(1.0)
    assert openness(*icosphere(3, 1.0)) == 0.0
    assert openness(*cap_of_sphere(0.0)) == pytest.approx(0.5, abs=0.05)
    # A cap of 60 degrees off: (pi sin^2 60) / (2 pi (1 + cos 60)) = 0.25.
    assert openness(*cap_of_sphere(0.5)) == pytest.approx(SHEET, abs=0.03)


@given(
    thickness=st.floats(1e-3, 0.3),
    scale=st.floats(1e-2, 1e2),
    bend=st.floats(-0.2, 0.2),
)
def test_a_shell_is_closed_outwards_and_has_the_volume_of_its_sheet(
    thickness: float, scale: float, bend: float
) -> None:
    x, faces = grid()
    x[:, 2] = bend * x[:, 0] ** 2
    x *= scale
    shell = thicken(x, faces, thickness * scale)
    report = examine(*shell)
    assert (report.open_edges, report.nonmanifold_edges, report.components) == (0, 0, 1)
    area = float(np.linalg.norm(face_area_vectors(x, faces), axis=1).sum())
    assert volume(*shell) == pytest.approx(area * thickness * scale, rel=0.05)
