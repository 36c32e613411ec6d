from __future__ import annotations

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.rest_mesh import MAX_BYTES, MAX_FACES, MAX_VERTICES, RestMesh
from cohaptic.protocol.version import PROTOCOL_VERSION
from tests.strategies import rest_meshes

TRIANGLE = RestMesh(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), ((0, 1, 2),))
HEAD = 12


def with_content(raw: bytes) -> bytes:
    return TRIANGLE.encode()[:HEAD] + zlib.compress(raw)


@given(rest_meshes)
def test_comes_back_as_it_was(mesh: RestMesh) -> None:
    assert RestMesh.decode(mesh.encode()) == mesh


@given(st.binary(max_size=300))
def test_any_bytes_give_a_mesh_or_the_peers_error(data: bytes) -> None:
    for frame in (data, TRIANGLE.encode()[:HEAD] + data, with_content(data)):
        try:
            RestMesh.decode(frame)
        except RemoteProtocolError:
            pass


@given(rest_meshes, st.data())
def test_a_damaged_frame_gives_a_valid_mesh_or_the_peers_error(
    mesh: RestMesh, data: st.DataObject
) -> None:
    frame = bytearray(mesh.encode())
    frame[data.draw(st.integers(0, len(frame) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        RestMesh.decode(bytes(frame)).encode()
    except RemoteProtocolError:
        pass


def test_the_largest_mesh_fits_whatever_its_numbers_are() -> None:
    # Random bytes cannot be deflated; as many as the largest mesh has.
    import random

    raw = random.Random(1).randbytes(12 * MAX_VERTICES + 6 * MAX_FACES)
    assert HEAD + len(zlib.compress(raw)) <= MAX_BYTES


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (b"", "frame length is 0"),
        (bytes([PROTOCOL_VERSION, 2, 0, 0]), "frame kind is 2; expected 3"),
        (TRIANGLE.encode()[:HEAD], "length of a rest mesh is 12"),
        (TRIANGLE.encode()[:HEAD] + bytes(9), "content of a rest mesh"),
        (with_content(bytes(41)), "inflated size of a rest mesh is 41; expected 42 bytes"),
        (with_content(bytes(43)), "inflated size of a rest mesh is 'more'; expected 42 bytes"),
        (TRIANGLE.encode() + b"x", "inflated size of a rest mesh is 'more'"),
        (TRIANGLE.encode()[:-1], "inflated size of a rest mesh is 42"),
        (with_content(bytes(36) + b"\0\0\1\0\3\0"), "corner of a face is 3; expected from 0 to 2"),
        (with_content(b"\xff" * 36 + bytes(6)), "vertex of a rest mesh is nan"),
        (with_content(b"\0\0\0\x42" * 9 + bytes(6)), "length of vertex of a rest mesh"),
        (bytes([PROTOCOL_VERSION, 3, 0, 0]) + b"\xff" * 9, "vertices of a rest mesh is 4294967295"),
        (
            bytes([PROTOCOL_VERSION, 3, 0, 0, 3, 0, 0, 0]) + b"\xff" * 9,
            "faces of a rest mesh is 4294967295",
        ),
    ],
)
def test_rubbish_is_named(frame: bytes, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        RestMesh.decode(frame)


def test_a_bomb_is_not_inflated() -> None:
    """A stranger's kilobyte must not become a gigabyte here."""
    bomb = with_content(bytes(50_000_000))
    assert len(bomb) < 100_000
    with pytest.raises(RemoteProtocolError, match="inflated size"):
        RestMesh.decode(bomb)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (RestMesh(TRIANGLE.vertices[:2], TRIANGLE.faces), "vertices of a rest mesh is 2"),
        (RestMesh(TRIANGLE.vertices, ()), "faces of a rest mesh is 0"),
        (RestMesh(TRIANGLE.vertices, ((0, 1, 3),)), "corner of a face is 3"),
        (RestMesh(((11.0, 0.0, 0.0),) * 3, TRIANGLE.faces), "length of vertex"),
    ],
)
def test_a_value_out_of_its_limits_is_a_local_error(mesh: RestMesh, message: str) -> None:
    with pytest.raises(LocalProtocolError, match=message):
        mesh.encode()
