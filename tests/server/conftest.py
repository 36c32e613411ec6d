from __future__ import annotations

import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings


@pytest.fixture(scope="session")
def balloon() -> Balloon:
    """The balloon that the server serves."""
    return Balloon()


@pytest.fixture(scope="session")
def small_balloon() -> Balloon:
    """A coarser one, for tests that take many ticks."""
    return Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))
