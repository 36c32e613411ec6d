"""What is shown of a world: the records, what counts as news, and one encoding for everybody."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cohaptic.control.room_lag import RoomLag
from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.patch import MAX_MARGIN, Patch
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.scene_surface import FINEST
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import EncodingName, Watch, Watching, decode_watch_control
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.spring import Spring, SpringSettings
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats
from cohaptic_server.room.room import Room
from cohaptic_server.room.watch.scene_broadcast import (
    MAX_SURFACE_BYTES,
    SceneBroadcast,
    SceneEncoder,
    displacement,
    records,
)
from cohaptic_server.room.watch.watcher import SIGN_OF_LIFE, Watcher
from cohaptic_server.settings import ServerSettings
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.server.peers import hello
from tests.server.room.watch.hands import PERIOD, motion, touches

MODEL = "0" * 32


def gallery(body: Body, model: str | None = MODEL, max_watchers: int = 5) -> SceneBroadcast:
    return SceneBroadcast(Room(body, ServerSettings(max_watchers=max_watchers)), model)


def come(shown: SceneBroadcast, encoding: EncodingName = "frames", rate: float = 60.0) -> Watcher:
    watch = Watch(protocol=PROTOCOL_VERSION, encoding=encoding, rate=rate)
    watcher = Watcher(watch, has_model=shown.model is not None)
    shown.enter(watcher, 0.0)
    return watcher


def scenes(watcher: Watcher, body: Body) -> list[Scene]:
    there = Traversal.of(len(body.mesh.vertices), body.mesh.faces)
    frames = [data for data in watcher.take(clear=True) if isinstance(data, bytes)]
    return [Scene.decode(frame, there) for frame in frames]


def test_a_record_is_what_the_patch_and_the_body_say(small_balloon: Balloon) -> None:
    for world, patches in motion(small_balloon, 30):
        for record, user in zip(records(world, patches), world.users.values(), strict=True):
            patch = patches[record.user]
            assert record.x_free == patch.x_free
            assert record.k_h == patch.k_h
            assert record.c_ii == patch.c_ii
            assert np.allclose(record.normal, patch.normal, atol=1e-6)
            assert record.force == pytest.approx(patch.own_force)
            assert record.k_o_coupled == user.k_o_coupled <= patch.k_o * (1.0 + 1e-12)
            # The force is what the loads are, with the other sign.
            whole = sum((load.force * load.direction for load in user.press.loads()), np.zeros(3))
            assert np.allclose(record.force, -whole)
            assert record.encode()


def test_everybody_is_shown_the_same_bytes(small_balloon: Balloon) -> None:
    shown = gallery(small_balloon)
    full, also_full, light = come(shown), come(shown), come(shown, "forces")
    for world, patches in motion(small_balloon, 5):
        shown.see(world, patches, world.tick * PERIOD)
        for watcher in (full, also_full, light):
            shown.show(watcher, world.tick * PERIOD, clear=True)
        *_, one = full.take(clear=True)
        *_, two = also_full.take(clear=True)
        (scene,) = scenes(light, small_balloon)
        assert one is two
        assert scene.surface is None
        assert len(scene.users) == 2
        for watcher in (full, also_full, light):
            watcher.receive(Ack(world.tick).encode(), world.tick * PERIOD)


def test_a_world_at_rest_costs_nothing_and_who_comes_late_sees_it_at_once(
    small_balloon: Balloon,
) -> None:
    shown = gallery(small_balloon)
    watcher = come(shown)
    sent = signs = 0
    world, patches = WorldState(), dict[int, Patch]()
    for world, patches in motion(small_balloon, 270, still=True):
        shown.see(world, patches, world.tick * PERIOD)
        shown.show(watcher, world.tick * PERIOD, clear=True)
        came = scenes(watcher, small_balloon)
        watcher.receive(Ack(world.tick).encode(), 0.0) if came else None
        sent += len(came)
        if world.tick > 240:
            # Without a surface: no more than a sign of life.
            assert all(scene.surface is None for scene in came)
            signs += len(came)
    assert sent > 10  # while the hands came
    assert signs <= 30 * PERIOD / SIGN_OF_LIFE + 1
    late = come(shown)
    shown.see(world, patches, world.tick * PERIOD)
    shown.show(late, world.tick * PERIOD, clear=True)
    (scene,) = scenes(late, small_balloon)
    assert scene.tick == world.tick
    assert scene.surface is not None
    n = len(small_balloon.mesh.vertices)
    assert np.abs(scene.surface.displacement - displacement(world, n)).max() <= FINEST


def test_a_viscous_body_is_shown_until_it_has_come_back() -> None:
    """Nobody is there any more, and still it moves: the records alone do not say that."""
    plate = Spring(SpringSettings(b_o=2000.0))
    shown = gallery(plate, model=None)
    watcher = come(shown, "forces")
    hand = replace(touches(1, users=1)[0], probe=(-0.01, 0.0, 0.0), force=(3.0, 0.0, 0.0))
    world, patches = WorldState(), dict[int, Patch]()
    for tick in range(1, 61):
        world, patches = advance(TouchedBody(plate), world, [hand], now=tick * PERIOD, dt=PERIOD)
    assert displacement(world, 1)[0, 0] < -0.01
    depth: list[float] = []
    for tick in range(61, 400):
        world, patches = advance(TouchedBody(plate), world, [], now=tick * PERIOD, dt=PERIOD)
        shown.see(world, patches, tick * PERIOD)
        shown.show(watcher, tick * PERIOD, clear=True)
        for scene in scenes(watcher, plate):
            watcher.receive(Ack(scene.tick).encode(), 0.0)
            if scene.surface is None:
                still = float(np.abs(displacement(world, 1)).max())
                assert still <= depth[-1] + 2 * FINEST, "a sign of life only where nothing moved"
                continue
            depth.append(float(np.abs(scene.surface.displacement).max()))
    assert len(depth) > 60
    assert depth[-1] <= 3 * FINEST


def test_who_is_taken_in_is_told_what_is_here_and_who_is_too_many_why(
    small_balloon: Balloon,
) -> None:
    room = Room(small_balloon, ServerSettings(max_watchers=2, allow_latency=True))
    room.join(hello("ann"), 0.0)
    shown = SceneBroadcast(room, MODEL)
    (text,) = come(shown).take(clear=True)
    watching = decode_watch_control(str(text))
    assert isinstance(watching, Watching)
    assert [(user.user, user.name) for user in watching.users] == [(1, "ann")]
    assert (watching.model, watching.allow_latency) == (MODEL, True)
    second = come(shown)
    with pytest.raises(RemoteProtocolError, match="number of watchers is 3") as caught:
        come(shown)
    assert caught.value.code is CloseCode.ROOM_FULL
    shown.leave(second)
    come(shown)
    assert shown.came == 3


def test_a_scene_that_the_wire_cannot_carry_is_not_shown_and_says_why(
    small_balloon: Balloon,
) -> None:
    shown = gallery(small_balloon)
    watcher = come(shown)
    watcher.take(clear=True)
    world, patches = next(motion(small_balloon, 1))
    shown.see(world, patches, float("nan"))
    shown.show(watcher, 0.0, clear=True)
    assert watcher.take(clear=True) == []
    assert shown.problem is not None
    assert "time stamp is nan" in shown.problem
    world = WorldState(2, world.users, world.response)
    shown.see(world, patches, 0.5)
    shown.show(watcher, 0.5, clear=True)
    assert len(watcher.take(clear=True)) == 1
    assert shown.problem is None


def test_the_rooms_time_is_shown_and_a_change_of_it_is_news() -> None:
    """Forces that are on their way do not show yet, but how long they take does."""
    x, faces = icosphere(1, 0.1)
    there = Traversal.of(len(x), faces)
    encoder = SceneEncoder(there, follows_records=True)
    rooms = [RoomLag(), RoomLag(0.125, 1.5, 2.0), RoomLag(0.125, 1.5, 2.0), RoomLag(0.0, 1.5, 2.0)]
    versions = list[int]()
    for tick, room in enumerate(rooms, start=1):
        encoder.see(tick, 0.0, (), lambda: np.zeros_like(x), room)
        shown = Scene.decode(encoder.frame(surface=False), there).room
        assert shown == replace(room, margin=min(room.margin, MAX_MARGIN))
        versions.append(encoder.version)
    assert versions == [1, 2, 2, 3]


def test_however_rough_a_surface_is_its_frame_is_bounded() -> None:
    x, faces = icosphere(6, 0.1)
    noise: Floats = np.random.default_rng(1).normal(scale=1e-2, size=x.shape)
    encoder = SceneEncoder(Traversal.of(len(x), faces), follows_records=True)
    encoder.see(1, 0.0, (), lambda: noise)
    frame = encoder.frame(surface=True)
    assert len(frame) <= MAX_SURFACE_BYTES + 100
    assert len(x) * 6 > 2 * MAX_SURFACE_BYTES  # it had to be coarser


def test_who_watches_a_still_room_hears_that_the_server_lives(small_balloon: Balloon) -> None:
    shown = gallery(small_balloon)
    watcher = come(shown)
    heard: list[float] = []
    for tick in range(1, 301):
        shown.see(WorldState(tick=tick), {}, tick * PERIOD)
        shown.show(watcher, tick * PERIOD, clear=True)
        for scene in scenes(watcher, small_balloon):
            heard.append(scene.tick * PERIOD)
            watcher.receive(Ack(scene.tick).encode(), tick * PERIOD)
    assert np.diff(heard).max() <= SIGN_OF_LIFE + 2 * PERIOD
    assert np.diff(heard).min() >= SIGN_OF_LIFE - 2 * PERIOD
    # Who acknowledges nothing gets no second one.
    for tick in range(301, 601):
        shown.see(WorldState(tick=tick), {}, tick * PERIOD)
        shown.show(watcher, tick * PERIOD, clear=True)
    assert len(scenes(watcher, small_balloon)) <= 1
