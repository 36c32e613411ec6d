from __future__ import annotations

import struct
import zlib
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from cohaptic.control.law import Law
from cohaptic.control.room_lag import NO_LAG, RoomLag
from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.patch import MAX_COUPLING, MAX_LAG, MAX_MARGIN, Geometry
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.scene_surface import FINEST, MAX_UNITS, Surface
from cohaptic.protocol.scene_users import HEAD_SIZE, MAX_USERS, USER_SIZE, UserRecord
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION
from tests.strategies import as_surface, scenes, surfaces, user_records

ANN = UserRecord(
    user=1, probe=(0.1, 0.0, 0.0), foot=(0.1, 0.0, 0.0), force=(2.0, 0.0, 0.0), c_ii=0.005,
    k_o_coupled=150.0, k_h=200.0, integral_gain=0.0, loop_delay=0.1, normal=(1.0, 0.0, 0.0),
    law=Law.PREDICTIVE, geometry=Geometry.SPHERE, presence=1.0, curvature=10.0, fresh=True,
    friction=False, x_free=(0.1, 0.0, 0.0),
)  # fmt: skip
FLAT = as_surface(1e-5, [(0, 0, 0)] * 3)
SCENE = Scene(5, 1.0, (ANN,))


TRIANGLE = Traversal.of(3, [(0, 1, 2)])


def traversal(scene: Scene) -> Traversal:
    """Of a strip of triangles with as many vertices as the scene has."""
    n = 3 if scene.surface is None else len(scene.surface.units)
    return Traversal.of(n, [(i, i + 1, i + 2) for i in range(n - 2)])


def with_stream(content: bytes, scale: float = 1e-5) -> bytes:
    """A frame of nobody with any deflated content behind it."""
    stream = zlib.compress(content)
    head = bytearray(Scene(5, 1.0, ()).encode(TRIANGLE))
    head[2] = 1
    return bytes(head) + struct.pack("<fI", scale, len(stream)) + stream


@given(scenes)
def test_comes_back_as_it_was(scene: Scene) -> None:
    there = traversal(scene)
    assert Scene.decode(scene.encode(there), there) == scene


@given(scenes)
def test_forces_of_two_fit_in_200_bytes(scene: Scene) -> None:
    light = replace(scene, surface=None).encode(TRIANGLE)
    assert len(light) == HEAD_SIZE + USER_SIZE * len(scene.users)
    assert HEAD_SIZE + 2 * USER_SIZE <= 200


@given(st.binary(max_size=300))
def test_any_bytes_give_a_scene_or_the_peers_error(data: bytes) -> None:
    for frame in (
        data,
        SCENE.encode(TRIANGLE)[:HEAD_SIZE] + data,
        with_stream(data),
        bytes([PROTOCOL_VERSION, 4, 1, 0]) + data,
    ):
        try:
            Scene.decode(frame, TRIANGLE)
        except RemoteProtocolError:
            pass


@given(scenes, st.data())
def test_a_damaged_frame_gives_a_valid_scene_or_the_peers_error(
    scene: Scene, data: st.DataObject
) -> None:
    there = traversal(scene)
    frame = bytearray(scene.encode(there))
    frame[data.draw(st.integers(0, len(frame) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        Scene.decode(bytes(frame), there).encode(there)
    except RemoteProtocolError:
        pass


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (b"", "frame length is 0"),
        (bytes([PROTOCOL_VERSION, 2, 0, 0]), "frame kind is 2; expected 4"),
        (bytes([PROTOCOL_VERSION, 4, 2, 0]) + bytes(24), "flags of a scene is 2"),
        (SCENE.encode(TRIANGLE)[:27], "scene length is 27; expected at least 28"),
        (SCENE.encode(TRIANGLE)[:-1], "scene length is 113; expected 114 bytes"),
        (SCENE.encode(TRIANGLE) + b"x", "scene length is 115; expected 114 bytes"),
        (bytes([PROTOCOL_VERSION, 4, 0, 0]) + bytes(24), "tick of a scene is 0"),
        (SCENE.encode(TRIANGLE)[:16] + b"\1\1" + bytes(86), "users of a scene is 257"),
        (with_stream(bytes(17)), "inflated size of a surface is 17; expected 18 bytes"),
        (with_stream(bytes(19)), "inflated size of a surface is 'more'"),
        (with_stream(bytes(18)) + b"x", "surface length"),
        (with_stream(bytes(18))[:-1], "surface length"),
        (with_stream(bytes(18), 0.0), "scale of a surface is 0.0"),
        (with_stream(bytes(18), float("nan")), "scale of a surface is nan"),
        (with_stream(bytes(18), 1.0), "scale of a surface is 1.0"),
    ],
)
def test_rubbish_is_named(frame: bytes, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        Scene.decode(frame, TRIANGLE)


@pytest.mark.parametrize(
    ("offset", "value", "message"),
    [
        (62, b"\x40", "law of a user is 4"),
        (62, b"\x00", "law of a user is 0"),
        (62, b"\x34", "geometry of a user is 4"),
        (66, b"\x04", "state of a user is 4"),
        (0, bytes(4), "number of a user is 0"),
        (56, bytes(6), "length of normal is 0"),
        (64, b"\x00\x7c", "curvature is inf"),
        (4, b"\xff\xff\xff\xff", "probe is nan"),
        (74, b"\x00\x7c", "entry of a tick's ledger is inf"),
        (84, b"\x00\xbc", "gain_cut is -1"),
    ],
)
def test_a_field_out_of_its_limits_is_named(offset: int, value: bytes, message: str) -> None:
    frame = bytearray(SCENE.encode(TRIANGLE))
    frame[HEAD_SIZE + offset : HEAD_SIZE + offset + len(value)] = value
    with pytest.raises(RemoteProtocolError, match=message):
        Scene.decode(bytes(frame), TRIANGLE)


@pytest.mark.parametrize(
    ("at", "kind", "value", "message"),
    [
        (20, "f", -1.0, "lag of the room is -1.0"),
        (20, "f", 2.0 * MAX_LAG, "lag of the room"),
        (24, "e", 2.0 * MAX_COUPLING, "coupling of the room"),
        (24, "e", float("nan"), "coupling of the room is nan"),
        (26, "e", -1.0, "margin of the room is -1.0"),
    ],
)
def test_a_room_out_of_its_limits_is_named(at: int, kind: str, value: float, message: str) -> None:
    frame = bytearray(SCENE.encode(TRIANGLE))
    struct.pack_into(f"<{kind}", frame, at, value)
    with pytest.raises(RemoteProtocolError, match=message):
        Scene.decode(bytes(frame), TRIANGLE)


def test_a_room_that_nothing_couples_is_as_far_from_the_edge_as_can_be_said() -> None:
    assert SCENE.room == NO_LAG
    there = Scene.decode(SCENE.encode(TRIANGLE), TRIANGLE)
    assert there.room == RoomLag(0.0, 0.0, MAX_MARGIN)


def test_a_bomb_is_not_inflated() -> None:
    bomb = with_stream(bytes(50_000_000))
    assert len(bomb) < 100_000
    with pytest.raises(RemoteProtocolError, match="inflated size"):
        Scene.decode(bomb, TRIANGLE)


@given(user_records)
def test_a_value_out_of_its_limits_is_a_local_error(user: UserRecord) -> None:
    for wrong in (
        replace(user, presence=1.1),
        replace(user, curvature=7e4),
        replace(user, x_free=(11.0, 0.0, 0.0)),
        replace(user, k_h=float("nan")),
        replace(user, user=0),
    ):
        with pytest.raises(LocalProtocolError):
            wrong.encode()
    with pytest.raises(LocalProtocolError, match="users of a scene is 257"):
        Scene(1, 0.0, (user,) * (MAX_USERS + 1)).encode(TRIANGLE)


displacements = hnp.arrays(
    np.float64, st.tuples(st.integers(3, 30), st.just(3)), elements=st.floats(-5.0, 5.0)
)


@given(displacements, st.floats(1e-6, 1.0))
def test_a_surface_is_within_half_a_unit(u: npt.NDArray[np.float64], size: float) -> None:
    u = u * size
    surface = Surface.of(u)
    assert surface.scale >= FINEST * (1.0 - 1e-6)
    assert surface.scale <= max(FINEST, float(np.abs(u).max()) / MAX_UNITS) * (1.0 + 1e-6)
    # Half a unit, and the rounding of the scale to 32 bits at the largest value.
    assert np.abs(surface.displacement - u).max() <= 0.501 * surface.scale


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 11.0])
def test_a_surface_out_of_the_world_is_our_mistake(value: float) -> None:
    with pytest.raises(LocalProtocolError, match="displacement of a surface"):
        Surface.of(np.full((3, 3), value))


@given(surfaces)
def test_equal_surfaces_have_equal_hashes(surface: Surface) -> None:
    again = Surface(surface.scale, surface.units.copy())
    assert again == surface
    assert hash(again) == hash(surface)
    again.units[0, 0] ^= 1
    assert again != surface
    assert FLAT != "flat"
