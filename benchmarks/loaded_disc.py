"""Presses of a solid for comparison with closed solutions: fingertips, and other pressures."""

from __future__ import annotations

import numpy as np
from scipy.special import roots_jacobi

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.contact import locate

_RINGS, _SPOKES = 24, 96  # quadrature points over the disc


def disc_load(mesh: SurfaceMesh, height: float, radius: float, power: float) -> Load:
    """A load of 1 N downwards whose pressure is (1 - r^2 / radius^2)^power about the z axis.

    With -1/2 it is that of a flat rigid punch on a half space, singular at its rim.

    Args:
        mesh: Resting surface, flat at the disc.
        height: z of the disc in the frame of the object's file [m].
        radius: Radius of the disc [m].
        power: Above -1.
    """
    # With s = 2 r^2 / radius^2 - 1 the pressure is Jacobi's weight (1 - s)^power.
    s, fractions = roots_jacobi(_RINGS, power, 0.0)
    r = radius * np.sqrt(0.5 * (1.0 + s))
    angle = 2.0 * np.pi * (np.arange(_SPOKES) + 0.5) / _SPOKES
    points = np.stack([np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel()], 1)
    weights = np.repeat(fractions / fractions.sum() / _SPOKES, _SPOKES)
    x = mesh.vertices + np.array(mesh.origin)
    on_top = np.abs(x[mesh.faces][:, :, 2] - height).max(axis=1) < 0.05 * radius
    area = face_area_vectors(mesh.vertices, mesh.faces)
    faces = mesh.faces[on_top & (area[:, 2] > 0.9 * np.linalg.norm(area, axis=1))]
    face, corner_fractions = _within(x[:, :2], faces, points)
    total = np.zeros(len(mesh.vertices))
    np.add.at(total, faces[face], weights[:, None] * corner_fractions)
    loaded = np.flatnonzero(total)
    return Load(loaded, total[loaded], np.array([0.0, 0.0, -1.0]), 1.0)


def pressed(solid: Solid, *places: tuple[float, float, float]) -> Floats:
    """Compliance between fingertips' presses at some places of its file, shape (k, k) [m/N]."""
    free, origin = np.zeros_like(solid.mesh.vertices), np.array(solid.mesh.origin)
    contacts = [
        locate(solid.mesh, np.array(at) - origin, free, radius=solid.contact_radius)
        for at in places
    ]
    return solid.respond([contact.load(1.0) for contact in contacts]).compliance


def _within(x: Floats, faces: Ints, points: Floats) -> tuple[Ints, Floats]:
    """Face of each point in a plane, and its barycentric coordinates there."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    to_b, to_c = b - a, c - a
    area = to_b[:, 0] * to_c[:, 1] - to_b[:, 1] * to_c[:, 0]
    off = points[:, None] - a[None]
    v = (off[..., 0] * to_c[:, 1] - off[..., 1] * to_c[:, 0]) / area
    w = (to_b[:, 0] * off[..., 1] - to_b[:, 1] * off[..., 0]) / area
    fractions = np.stack([1.0 - v - w, v, w], axis=-1)
    best = fractions.min(axis=-1).argmax(axis=1)
    chosen = fractions[np.arange(len(points)), best]
    if chosen.min() < -1e-3:
        raise ValueError("the disc reaches beyond the flat surface")
    return best, chosen
