"""A jelly: a soft block on a plate, with mass."""

from __future__ import annotations

import functools

import numpy as np

from cohaptic_server.bodies.modal.modal_body import ModalBody, Modes
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.solid.vibration import Vibration, natural_modes
from cohaptic_server.testing.blocks import block

DT = 1.0 / 60.0  # s


@functools.cache
def solid() -> Solid:
    """60 x 60 x 120 mm, held at its base."""
    mesh = block((0.06, 0.06, 0.12), (3, 3, 6))
    return Solid(mesh, mesh.vertices[:, 2] <= 0.0, SolidSettings(6e3, 0.45, 0.012))


@functools.cache
def vibration() -> Vibration:
    """Of water's density, six modes of 1.5 Hz and more."""
    return natural_modes(solid().shape, 1000.0, 6)


def modes(damping: float = 0.1, count: int = 3) -> Modes:
    """The lowest ones on the surface: two ways to bend, and a twist."""
    found, shape = vibration(), solid().shape
    shapes = found.shapes[:count, shape.surface] / found.frequency[:count, None, None]
    return Modes(found.frequency[:count], np.ascontiguousarray(shapes), damping)


def jelly(damping: float = 0.1, dt: float = DT) -> ModalBody:
    """The block that swings."""
    return ModalBody(solid(), modes(damping), dt)
