"""Presses on a body at rest, for the tests of bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from cohaptic_server.bodies.body import Body, DenseResponse, Load
from cohaptic_server.testing.check_body import Responding, depth, settled
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


def check_derivatives(
    body: Responding[DenseResponse], loads: Sequence[Load], at: DenseResponse
) -> None:
    """Fields and compliance of a nonlinear body against central differences of its responses.

    Args:
        body: The body.
        loads: Its contacts.
        at: Its response to them, settled.
    """
    h = 1e-3  # N
    for i, load in enumerate(loads):
        up, down = (
            settled(body, [*loads[:i], replace(load, force=force), *loads[i + 1 :]], at)
            for force in (load.force + h, load.force - h)
        )
        change = (up.displacement - down.displacement) / (2.0 * h)
        # Not less than: a contact on a fixed part moves nothing.
        assert np.abs(change - at.fields[i]).max() <= 1e-4 * np.abs(at.fields[i]).max()
        row = [(depth(one, up) - depth(one, down)) / (2.0 * h) for one in loads]
        assert at.compliance[i] == pytest.approx(row, abs=1e-4 * np.abs(at.compliance[i]).max())
