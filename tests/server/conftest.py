from __future__ import annotations

import pytest

import cohaptic_server  # puts compiled kernels in use
from cohaptic.compiled import describe, is_complete
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from tests.give_up import give_up

assert cohaptic_server


@pytest.fixture(scope="session")
def kernels() -> None:
    """For tests of finite deformation, which is not served as plain Python."""
    if not is_complete("kernels"):
        give_up(f"kernels: {describe('kernels')}")


@pytest.fixture(scope="session")
def balloon() -> Balloon:
    """The balloon that the server serves."""
    return Balloon()


@pytest.fixture(scope="session")
def small_balloon() -> Balloon:
    """A coarser one, for tests that take many ticks."""
    return Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))
