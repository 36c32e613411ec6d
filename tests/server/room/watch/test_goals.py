"""What a scene may cost and how true it has to be, on the balloon that the goals are stated for."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from cohaptic.protocol.scene import Scene
from cohaptic.protocol.traversal import Traversal
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.green import Superposition, decode_block, encode_block
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.room.watch.audience import SceneEncoder, displacement, records
from tests.server.room.watch.fine_balloon import FineBalloon
from tests.server.room.watch.hands import motion

SURFACE_BYTES = 4_500
FORCES_BYTES = 200
SHARE = 1e-3  # of the largest displacement


def test_the_fine_balloon_is_the_balloon(small_balloon: Balloon) -> None:
    fine = FineBalloon(subdivisions=2)
    vertices, weights = np.array([3, 40, 41]), np.array([0.5, 0.25, 0.25])
    load = Load(vertices, weights, np.array([0.6, 0.0, -0.8]), 2.0)
    want, got = small_balloon.respond([load]), fine.respond([load])
    assert np.abs(got.displacement - want.displacement).max() < 1e-9


@pytest.mark.slow
def test_frames_are_small_and_forces_give_the_surface() -> None:
    body = FineBalloon()
    mesh = body.mesh
    assert len(mesh.vertices) == 2562
    n = len(mesh.vertices)
    there = Traversal.of(n, mesh.faces)
    encoder = SceneEncoder(there, follows_records=True)
    source = Superposition(body)
    blocks: dict[int, np.ndarray[tuple[int, ...], np.dtype[np.float64]]] = {}
    for world, patches in motion(body, 45):
        shape = displacement(world, n)
        encoder.see(world.tick, 0.0, records(world, patches), functools.partial(np.copy, shape))
        full, light = encoder.frame(surface=True), encoder.frame(surface=False)
        assert len(full) <= SURFACE_BYTES
        assert len(light) <= FORCES_BYTES
        if world.tick % 15 != 0:
            continue
        largest = np.abs(shape).max()
        assert largest > 0.002
        shown = Scene.decode(full, there)
        assert shown.surface is not None
        assert np.abs(shown.surface.displacement - shape).max() <= 0.501e-5
        made = np.zeros((n, 3))
        for user in Scene.decode(light, there).users:
            vertices, weights = pressure(
                mesh, np.array(user.foot), body.contact_radius, np.array(user.normal)
            )
            for vertex, weight in zip(vertices.tolist(), weights.tolist(), strict=True):
                if vertex not in blocks:
                    blocks[vertex] = decode_block(encode_block(source.green(vertex)))
                made -= weight * np.tensordot(np.array(user.force), blocks[vertex], axes=1)
        assert np.abs(made - shape).max() <= SHARE * largest
