from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.contact import locate
from cohaptic_server.world.displacement_field import (
    LARGEST_PRODUCT,
    CachedField,
    FlatterField,
    FreeField,
    KnownFields,
    ZeroField,
    flatten_bulges,
)
from tests.examples_of_laws import examples
from tests.server.fields import bulge

vertices = st.lists(st.integers(0, 161), min_size=1, max_size=30)


class Counted:
    """A field that counts what it is asked for."""

    def __init__(self, values: Floats) -> None:
        self.values = values
        self.asked = 0

    def __getitem__(self, vertices: Ints, /) -> Floats:
        self.asked += vertices.size
        return np.asarray(self.values[vertices])


@given(vertices, vertices)
def test_a_window_says_the_same_as_its_field_and_asks_only_for_what_it_lacks(
    known: list[int], asked: list[int]
) -> None:
    values = np.random.default_rng(1).normal(size=(162, 3))
    field = Counted(values)
    at_once = np.unique(known)
    window = CachedField(at_once, field[at_once], field)
    field.asked = 0
    at = np.array(asked)
    assert (window[at] == values[at]).all()
    assert field.asked == sum(v not in known for v in asked)
    pairs = np.stack([at, at[::-1]], axis=1)  # any shape, as a list of faces has one
    assert (window[pairs] == values[pairs]).all()


@given(st.floats(0.0, 3.0), st.floats(0.0, 8.0), st.floats(0.0, 8.0), vertices)
@settings(max_examples=examples(20), deadline=None)
def test_free_of_one_user_is_the_body_under_the_others(
    small_balloon: Balloon, angle: float, mine: float, theirs: float, asked: list[int]
) -> None:
    at_rest = np.zeros_like(small_balloon.mesh.vertices)
    one, two = (
        locate(small_balloon.mesh, 0.09 * np.array([np.cos(a), np.sin(a), 0.0]), at_rest, radius=r)
        for a, r in ((0.0, 0.02), (angle, 0.02))
    )
    both = small_balloon.respond([one.load(mine), two.load(theirs)])
    alone = small_balloon.respond([two.load(theirs)]).displacement
    at = np.array(asked)
    free = FreeField(both, np.array([mine]), slice(0, 1))[at]
    assert np.abs(free - alone[at]).max() < 1e-12
    whole = FreeField(both, np.zeros(0), slice(0, 0))[at]
    assert np.abs(whole - both.displacement[at]).max() < 1e-15


@pytest.mark.parametrize("depth", [0.0, 1e-3, 0.02, 0.3])
@pytest.mark.parametrize("sharp", [-60.0, 5.0, 60.0])
def test_a_bulge_is_no_sharper_than_lets_a_probe_stay_on_it(depth: float, sharp: float) -> None:
    mesh = SurfaceMesh(*icosphere(4, 0.1))
    every = np.arange(len(mesh.vertices))
    at = mesh.vertices[0]
    out = at / np.linalg.norm(at)
    heights = 0.03 - 0.5 * sharp * ((mesh.vertices - at) ** 2).sum(axis=1)
    free: Floats = heights[:, None] * out
    frame, x_free = np.array([at, at, out]), at + 0.03 * out
    # A second contact, of a probe in the air, on the same surface.
    both = KnownFields(
        np.array([0, len(every), 2 * len(every)]), np.tile(every, 2), np.tile(free, (2, 1))
    )
    shown = flatten_bulges(
        mesh, both, np.array([frame, frame]), np.array([x_free, x_free]), np.array([depth, -0.3]),
        0.01,
    )  # fmt: skip
    values, other = np.split(both.values, 2)
    assert (other == free).all()
    assert values[0] == pytest.approx(0.03 * out)  # the contact stays
    assert shown[:, :3] == pytest.approx(np.array([x_free, x_free]) - at)
    found = bulge(mesh, every, free, frame, 0.01)
    assert found == pytest.approx(sharp, rel=0.1)
    if depth * found <= LARGEST_PRODUCT:
        assert (values == free).all()
        assert shown[:, 3].tolist() == [1.0, 1.0]
    else:
        left = depth * bulge(mesh, every, values, frame, 0.01)
        assert left == pytest.approx(LARGEST_PRODUCT)
        # Elsewhere, too, so that a window does not end in a step.
        fraction = LARGEST_PRODUCT / (depth * found)
        assert shown[:, 3] == pytest.approx(np.array([fraction, 1.0]))
        elsewhere = FlatterField(ZeroField(), shown[0, :3], shown[0, 3])
        assert elsewhere[every[:1]] == pytest.approx(0.03 * (1.0 - fraction) * out[None])
