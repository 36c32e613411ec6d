from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.quantised_mesh import STEPS, QuantisedMesh
from cohaptic.protocol.rest_mesh import MAX_VERTICES, RestMesh
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic_server.mesh.icosphere import icosphere
from tests.strategies import rest_meshes

SQUARE = QuantisedMesh.of(
    np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.0]]),
    np.array([[0, 1, 2], [0, 2, 3]]),
)
HEAD = 36
BOX = 12  # where it begins


def with_content(raw: bytes) -> bytes:
    return SQUARE.encode()[:HEAD] + zlib.compress(raw)


def with_box(*numbers: float) -> bytes:
    return SQUARE.encode()[:BOX] + struct.pack("<6f", *numbers) + SQUARE.encode()[HEAD:]


def with_counts(n: int, m: int) -> bytes:
    return SQUARE.encode()[:4] + struct.pack("<2I", n, m) + SQUARE.encode()[BOX:]


def triangles_of(mesh: RestMesh) -> list[tuple[int, int, int]]:
    return [face for face in mesh.faces if len(set(face)) == 3] or [(0, 1, 2)]


@given(rest_meshes)
@example(RestMesh(((10.0, 0.0, 0.0), (-10.0, 1e-30, 0.0), (0.1, 0.0, 0.0)), ((0, 1, 2),)))
@example(RestMesh(((0.1, 0.1, 0.1),) * 3, ((0, 1, 2),)))
def test_a_vertex_is_half_a_unit_off_at_most_and_faces_are_as_they_were(mesh: RestMesh) -> None:
    vertices, faces = np.array(mesh.vertices), np.array(triangles_of(mesh))
    sent = QuantisedMesh.of(vertices, faces)
    got = QuantisedMesh.decode(sent.encode())
    assert (got.faces == faces).all()
    assert (got.places == sent.places).all()
    box = np.ptp(vertices, axis=0)
    # Corner and unit of the box have 24 bits: with their rounding a unit may be so much longer.
    rounding = 2.0**-22 * np.abs(vertices).max(axis=0) / STEPS + 1e-42
    unit = box / STEPS * (1.0 + 2.0**-22) + rounding
    assert (np.abs(got.vertices - vertices) <= 0.5 * unit + 1e-15).all()


def test_it_is_much_shorter_than_the_exact_mesh() -> None:
    sphere, f = icosphere(4, 0.1)
    # Sheared, for the coordinates of the sphere itself repeat each other.
    x = sphere @ np.random.default_rng(1).normal(0.0, 1.0, (3, 3))
    exact = RestMesh(
        tuple((a, b, c) for a, b, c in x.tolist()), tuple((a, b, c) for a, b, c in f.tolist())
    )
    assert len(QuantisedMesh.of(x, f).encode()) < 0.6 * len(exact.encode())


@given(st.permutations(range(20)))
def test_the_order_of_the_vertices_is_that_of_the_scenes_whatever_the_order_of_the_faces(
    order: list[int],
) -> None:
    _, faces = icosphere(0, 1.0)
    ours, theirs = Traversal.of(12, faces), Traversal.of(12, faces[order])
    for name in ("order", "p", "q", "r"):
        assert (getattr(ours, name) == getattr(theirs, name)).all()


@given(st.binary(max_size=300))
def test_any_bytes_give_a_mesh_or_the_peers_error(data: bytes) -> None:
    for frame in (data, SQUARE.encode()[:HEAD] + data, with_content(data)):
        try:
            QuantisedMesh.decode(frame)
        except RemoteProtocolError:
            pass


@given(st.data())
def test_a_damaged_frame_gives_a_valid_mesh_or_the_peers_error(data: st.DataObject) -> None:
    frame = bytearray(SQUARE.encode())
    frame[data.draw(st.integers(0, len(frame) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        got = QuantisedMesh.decode(bytes(frame))
    except RemoteProtocolError:
        return
    assert (np.abs(got.vertices) < 10.001).all()
    got.encode()


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (b"", "frame length is 0"),
        (bytes([PROTOCOL_VERSION, 3, 0, 0]), "flags of a quantised mesh is 0"),
        (bytes([PROTOCOL_VERSION, 3, 3, 0]), "flags of a quantised mesh is 3"),
        (SQUARE.encode()[:HEAD], "length of a quantised mesh is 36"),
        (SQUARE.encode()[:HEAD] + bytes(9), "content of a rest mesh"),
        (with_content(bytes(35)), "inflated size of a rest mesh is 35; expected 36 bytes"),
        (with_content(bytes(37)), "inflated size of a rest mesh is 'more'; expected 36 bytes"),
        (SQUARE.encode() + b"x", "inflated size of a rest mesh is 'more'"),
        (with_content(b"\4" + bytes(35)), "corner of a face is 4; expected from 0 to 3"),
        (with_content(bytes(36)), "triangles alone is False"),
        (with_counts(2**32 - 1, 2), "vertices of a rest mesh is 4294967295"),
        (with_counts(4, 2**32 - 1), "faces of a rest mesh is 4294967295"),
        (with_counts(MAX_VERTICES, 2), "inflated size of a rest mesh is 36"),
        (with_counts(3, 2), "inflated size of a rest mesh is 'more'"),
        (with_box(11.0, 0.0, 0.0, 0.0, 0.0, 0.0), "low end of a mesh's box is 11.0"),
        (with_box(0.0, np.nan, 0.0, 0.0, 0.0, 0.0), "low end of a mesh's box is nan"),
        (with_box(0.0, 0.0, 0.0, 1.0, 0.0, 0.0), "size of a mesh's box is 65535.0"),
        (with_box(0.0, 0.0, 0.0, 0.0, -1e-9, 0.0), "size of a mesh's box is -6"),
        (with_box(0.0, 0.0, 0.0, 0.0, 0.0, np.nan), "size of a mesh's box is nan"),
    ],
)
def test_rubbish_is_named(frame: bytes, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        QuantisedMesh.decode(frame)


def test_a_bomb_is_not_inflated() -> None:
    bomb = with_content(bytes(50_000_000))
    with pytest.raises(RemoteProtocolError, match="inflated size"):
        QuantisedMesh.decode(bomb)


def test_who_did_not_ask_for_it_says_so() -> None:
    with pytest.raises(RemoteProtocolError, match="rest mesh is 'quantised'; expected an exact"):
        RestMesh.decode(SQUARE.encode())


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        ([(0.0, 0.0, 0.0)] * 2, [(0, 1, 1)], "vertices of a rest mesh is 2"),
        ([(0.0, 0.0, 0.0)] * 3, [(0, 1, 3)], "corner of a face is 3"),
        ([(0.0, 0.0, 0.0)] * 3, [(0, 1, 1)], "triangles alone is False"),
        ([(0.0, 0.0, 0.0)] * 3, [(0, 0, 1)], "triangles alone is False"),
        ([(0.0, 0.0, 0.0)] * 3, [(0, 1, 0)], "triangles alone is False"),
        ([(11.0, 0.0, 0.0)] * 3, [(0, 1, 2)], "coordinate of a rest mesh is 11"),
        ([(np.nan, 0.0, 0.0)] * 3, [(0, 1, 2)], "coordinate of a rest mesh is nan"),
    ],
)
def test_a_value_out_of_its_limits_is_a_local_error(
    vertices: list[tuple[float, float, float]], faces: list[tuple[int, int, int]], message: str
) -> None:
    with pytest.raises(LocalProtocolError, match=message):
        QuantisedMesh.of(np.array(vertices), np.array(faces)).encode()
