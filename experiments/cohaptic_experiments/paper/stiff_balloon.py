"""The triangle mesh of Figs. 10 and 11: a balloon as stiff as the paper's object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import Body
from cohaptic_server.world.contact import locate

K_O = 1000.0  # N/m, of Fig. 11


def stiff_balloon(*, quick: bool) -> Balloon:
    """A balloon of `K_O` where the rig presses; its stiffness goes with the rubber's."""
    # Held up to near its middle: it gives way under the probe instead of leaning away.
    mesh, contact = (2, 0.03) if quick else (3, 0.018)
    settings = BalloonSettings(base=0.2, subdivisions=mesh, contact_radius=contact)
    softness = stiffness_at_x(Balloon(settings)) / K_O
    return Balloon(replace(settings, mu_h=settings.mu_h / softness))


def stiffness_at_x(body: Body) -> float:
    """K_o of the contact on the +x side [N/m]."""
    x = body.mesh.vertices
    probe = np.array([x[:, 0].max(), 0.0, 0.0])
    contact = locate(body.mesh, probe, np.zeros_like(x), radius=body.contact_radius)
    return 1.0 / float(body.respond([contact.load(0.0)]).compliance[0, 0])
