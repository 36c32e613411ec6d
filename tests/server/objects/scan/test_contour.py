from __future__ import annotations

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.objects.scan.contour import VOLUME, surface_of
from cohaptic_server.objects.surface.checks import examine

pytest.importorskip("skimage", reason="pip install 'cohaptic[scans]' contours labels")

RADIUS = 0.02


def ball(spacing: tuple[float, float, float], room: float = 1.3) -> tuple[Mask, Floats]:
    """Voxels of a ball about the origin, and where they are; less room cuts it at the border."""
    counts = [int(2.0 * room * RADIUS / s) for s in spacing]
    affine = np.zeros((3, 4))
    affine[:, :3] = np.diag(spacing)
    affine[:, 3] = [-0.5 * s * (n - 1) for s, n in zip(spacing, counts, strict=True)]
    x = np.moveaxis(np.indices(counts), 0, -1) @ affine[:, :3].T + affine[:, 3]
    return np.linalg.norm(x, axis=-1) < RADIUS, affine


def tilt(x: Floats, faces: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> float:
    """Root mean square of the angle between the faces of a ball and where they should face."""
    area = face_area_vectors(x, faces)
    middle = x[faces].mean(axis=1)
    cosine = np.abs((area * middle).sum(axis=1))
    cosine /= np.linalg.norm(area, axis=1) * np.linalg.norm(middle, axis=1)
    return float(np.degrees(np.sqrt((np.arccos(np.clip(cosine, 0.0, 1.0)) ** 2).mean())))


@pytest.mark.parametrize("spacing", [(1e-3, 1e-3, 1e-3), (0.8e-3, 0.8e-3, 4e-3)])
def test_a_ball_of_voxels_becomes_a_smooth_ball_of_the_same_volume(
    spacing: tuple[float, float, float],
) -> None:
    region, affine = ball(spacing)
    x, faces = surface_of(region, affine)
    report = examine(x, faces)
    assert not report.problems()
    assert report.components == 1
    voxels = region.sum() * np.prod(spacing)
    assert abs(volume(x, faces)) == pytest.approx(voxels, rel=VOLUME)
    assert np.abs(np.linalg.norm(x, axis=1) - RADIUS).max() < 0.5 * max(spacing)
    assert tilt(x, faces) < 8.0


def test_turned_and_mirrored_voxels_lie_where_the_header_says() -> None:
    region, affine = ball((1e-3, 1e-3, 2e-3))
    turned = affine[[2, 0, 1]] * np.array([[-1.0], [1.0], [1.0]]) + np.array([0, 0, 0, 0.1])
    x, faces = surface_of(region, turned)
    assert x.mean(axis=0) == pytest.approx([0.1, 0.1, 0.1], abs=2e-4)
    assert abs(volume(x - 0.1, faces)) == pytest.approx(region.sum() * 2e-9, rel=VOLUME)


def test_a_plate_two_voxels_thick_keeps_its_volume() -> None:
    region = np.zeros((20, 20, 8), dtype=np.bool_)
    region[3:17, 3:17, 3:5] = True
    x, faces = surface_of(region, np.eye(3, 4) * 1e-3)
    assert abs(volume(x, faces)) == pytest.approx(region.sum() * 1e-9, rel=0.05)


def test_a_single_voxel_is_no_object() -> None:
    region = np.zeros((9, 9, 9), dtype=np.bool_)
    region[4, 4, 4] = True
    with pytest.raises(BodyError, match="too small for a surface"):
        surface_of(region, np.eye(3, 4) * 1e-3)
