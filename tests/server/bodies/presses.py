"""Presses on a body at rest, for the tests of bodies."""

from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.world.contact import locate

_DISTANCE = 0.1  # m from the middle of the bodies in these tests, on or over their surface


def press(body: Body, direction: object, force: float, radius: float | None = None) -> Load:
    """A press towards the middle of a body's box.

    Args:
        body: The body.
        direction: From the middle to the hand, of any length, shape (3,).
        force: Magnitude [N].
        radius: Contact radius [m]; the body's own if not given.
    """
    x, d = body.mesh.vertices, np.array(direction, dtype=float)
    middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
    tip = middle + _DISTANCE * d / np.linalg.norm(d)
    contact = locate(body.mesh, tip, np.zeros_like(x), radius=radius or body.contact_radius)
    return contact.load(force)
