from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.protocol.frame import MAX_FRAME_BYTES, MAX_MESH_FRAME_BYTES
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.vec import ZERO, Vec3, dot, norm, scale, sub, unit
from cohaptic_client.loop.state import SurfaceMaker
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.room.room import Room
from cohaptic_server.settings import ServerSettings
from cohaptic_server.world.contact import Contact, locate
from cohaptic_server.world.patch_geometry import NO_WINDOWS, Windows, choose_windows
from cohaptic_server.world.state import Touch
from tests.examples_of_laws import examples
from tests.server.fields import free_of
from tests.server.touches import RADIUS, changed, contacts_of, side, touch
from tests.server.world.worlds import play

angles = st.floats(-math.pi, math.pi)


def patches(body: Balloon, hand: Touch, *others: Touch) -> dict[Geometry, Patch]:
    """The patch that a hand gets with each geometry."""
    return {g: play(body, [changed(hand, geometry=g), *others])[1][hand.user] for g in Geometry}


@given(angles, st.floats(-0.01, 0.02), st.floats(0.0, 8.0))
@settings(max_examples=examples(10), deadline=None)
def test_geometries_differ_in_their_shape_only_and_keep_to_their_frames(
    balloon: Balloon, angle: float, depth: float, force: float
) -> None:
    found = patches(balloon, touch(at=side(angle), depth=depth, force=force))
    for geometry, patch in found.items():
        assert patch.geometry is geometry
        plain = replace(patch, geometry=Geometry.PLANE, curvature=0.0, neighbourhood=None)
        assert plain == found[Geometry.PLANE]
        limit = MAX_MESH_FRAME_BYTES if geometry is Geometry.MESH else MAX_FRAME_BYTES
        assert len(patch.encode()) <= limit
    # However hard it is pressed: the surface free of the own force is the resting one.
    assert found[Geometry.SPHERE].curvature == pytest.approx(1.0 / RADIUS, rel=0.05)


@given(st.floats(0.4, 1.2), st.floats(0.0, 4.0), st.floats(-0.3, 0.3), st.floats(0.0, 0.02))
@settings(max_examples=examples(15), deadline=None)
def test_a_probe_finds_on_the_mesh_what_the_server_would_find(
    balloon: Balloon, beside: float, pressed: float, slid: float, depth: float
) -> None:
    """Also where another hand has bent the surface, and away from the contact of the patch."""
    hand, other = touch(1, force=2.0), touch(2, at=side(beside), force=pressed)
    mesh = RestMesh.decode(Room(balloon, ServerSettings()).frames.touch_mesh())
    surface = SurfaceMaker(mesh)(patches(balloon, hand, other)[Geometry.MESH])
    state, _ = play(balloon, [changed(hand, geometry=Geometry.MESH), other])
    assert state.response is not None
    free = free_of(state.response, 0, state.users[1].force)
    probe = scale(side(slid), RADIUS - depth)
    contact = locate(balloon.mesh, np.array(probe), free, radius=balloon.contact_radius)
    reference = float(contact.normal @ (contact.moved(free) - np.array(probe)))
    c_ii = balloon.respond([contact.load(0.0)]).compliance[0, 0]
    sight = surface.look(probe)
    # On a surface bent by 15 mm over 4 cm the vertices and the mean under the pressure differ a
    # little, and so do the normals there from those at rest, along which the table's c_ii are.
    assert sight.depth == pytest.approx(reference, abs=2e-5 + 0.0003 * pressed)
    assert sight.c_ii == pytest.approx(c_ii, rel=0.01 + 0.015 * pressed)
    assert dot(sight.normal, tuple(contact.normal.tolist())) > 0.99


def test_the_mesh_reaches_ahead_of_a_hand_that_slides(balloon: Balloon) -> None:
    speed, dt, lag = 0.1, 1.0 / 60.0, 10
    state, last, angle = None, None, 0.0
    for tick in range(1, 60):
        angle = speed * tick * dt / RADIUS
        probe = scale(side(angle), RADIUS - 0.005)
        made_with = max(0, tick - lag)
        hand = changed(
            touch(),
            geometry=Geometry.MESH,
            probe=probe,
            seq=tick,
            tick=made_with,
            t_client=tick * dt,
        )
        state, found = play(balloon, [hand], 1, state)
        last = found[1]
    assert last is not None
    assert last.neighbourhood is not None
    ahead = scale(side(angle + speed * (lag + 2) * dt / RADIUS), RADIUS)
    chosen = set(last.neighbourhood.indices)
    for k, v in enumerate(balloon.mesh.vertices.tolist()):
        if norm(sub((v[0], v[1], v[2]), ahead)) < 0.04:
            assert k in chosen


def test_a_hand_that_says_impossible_times_gets_patches_all_the_same(balloon: Balloon) -> None:
    state = None
    for seq, t in enumerate([0.0, 1e300, -1e300, 1e-300, 0.0, 0.002], start=1):
        hand = changed(
            touch(), geometry=Geometry.MESH, seq=seq, t_client=t, probe=unit((1.0, 0.1 * seq, 9.0))
        )
        state, found = play(balloon, [hand], 1, state)
        found[1].encode()


@given(st.floats(-1.0, 1.0), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
@settings(max_examples=examples(20), deadline=None)
def test_a_window_is_kept_while_a_finger_hardly_moves(
    balloon: Balloon, slid: float, first: float, later: float
) -> None:
    """It stays at rest, and is the one that is chosen anew as soon as something has changed."""
    still = np.zeros_like(balloon.mesh.vertices)
    here, there = (
        locate(balloon.mesh, np.array(side(a)) * 0.099, still, radius=balloon.contact_radius)
        for a in (0.0, slid)
    )
    body = TouchedBody(balloon)

    def choose(
        contact: Contact,
        horizon: float,
        before: Windows | None,
        geometry: Geometry = Geometry.MESH,
        velocity: Vec3 = ZERO,
    ) -> Windows:
        # Somebody else comes before in the same call, and stays where it is.
        contacts, velocities = contacts_of([here, contact]), np.array([ZERO, velocity])
        rows = np.array([-1, -1] if before is None else [0, 1])
        horizons = np.array([first, horizon])
        return choose_windows(
            body, [Geometry.MESH, geometry], contacts, velocities, horizons, rows,
            NO_WINDOWS if before is None else before,
        )  # fmt: skip

    def parts(windows: Windows) -> list[list[int]]:
        """Vertices, those that are fitted, touched, and carried, of the second user."""
        a, b = windows.starts[:, 1], windows.starts[:, 2]
        carried = windows.carried[a[2] : b[2]] - a[0]
        flat = (windows.vertices[a[0] : b[0]], windows.fitted[a[1] : b[1]])
        return [part.tolist() for part in (*flat, windows.touched[a[2] : b[2]], carried)]

    previous = choose(here, first, None)
    assert parts(choose(here, first, previous)) == parts(previous)
    now = choose(there, later, previous)
    if (now.keys[1] != previous.keys[1]).any():
        assert parts(now) == parts(choose(there, later, None))
    elif slid != 0.0:
        assert abs(slid) < 0.05
        assert parts(now) == parts(previous)
    assert (now.keys[0] == previous.keys[0]).all()
    quick = choose(here, 0.3, previous, velocity=(0.0, 0.3, 0.0))
    assert (quick.keys[1] != previous.keys[1]).any()
    vertices, _, touched, _ = parts(choose(here, first, previous, Geometry.PLANE))
    assert set(vertices) <= set(parts(previous)[0])
    assert not touched
