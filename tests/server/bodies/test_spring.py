from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_server.bodies.body import Load, Response
from cohaptic_server.bodies.spring import Spring, SpringSettings
from cohaptic_server.world.contact import locate


def press(body: Spring, y: float, z: float, force: float) -> Load:
    free = np.zeros_like(body.mesh.vertices)
    return locate(body.mesh, np.array([-0.01, y, z]), free, radius=body.contact_radius).load(force)


def depth(response: Response) -> float:
    return -float(response.displacement[0, 0])


@given(
    st.floats(10.0, 5000.0),
    st.floats(0.0, 500.0),
    st.lists(st.floats(0.0, 20.0), min_size=1, max_size=40),
)
def test_it_moves_as_eq_9_says(k_o: float, b_o: float, forces: list[float]) -> None:
    body = Spring(SpringSettings(k_o=k_o, b_o=b_o))
    x, response = 0.0, None
    for force in forces:
        x = (force + b_o * x) / (k_o + b_o)
        response = body.respond([press(body, 0.0, 0.0, force)], response)
        assert depth(response) == pytest.approx(x, rel=1e-9, abs=1e-15)
        # Rigid: no vertex moves otherwise than the first.
        assert np.ptp(response.displacement, axis=0).max() == 0.0


@pytest.mark.parametrize("change", [{"k_o": 0.0}, {"b_o": -1.0}, {"side": 0.0}, {"cells": 0}])
def test_absurd_springs_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(SettingError, match="spring"):
        SpringSettings(**change)
