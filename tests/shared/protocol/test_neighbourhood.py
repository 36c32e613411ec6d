from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.frame import MAX_FRAME_BYTES, MAX_MESH_FRAME_BYTES
from cohaptic.protocol.neighbourhood import ITEM_SIZE, MAX_VERTICES, Neighbourhood
from cohaptic.protocol.patch import SIZE, Geometry, Patch
from tests.client.plane import PLANE
from tests.strategies import mesh_patches, neighbourhoods, vectors

UNITS: dict[str, Any] = {
    "scale": 1e-6,
    "c_scale": 1e-7,
    "indices": (3, 7, 9),
    "displacements": ((1, -2, 3), (0, 0, 0), (9, 9, 9)),
    "compliances": (7, 8, 9),
}
NEAR = Neighbourhood.of_units(**UNITS)
MESH = replace(PLANE, geometry=Geometry.MESH, neighbourhood=NEAR)


@given(mesh_patches)
def test_a_mesh_patch_comes_back_as_it_was(patch: Patch) -> None:
    data = patch.encode()
    assert len(data) <= MAX_MESH_FRAME_BYTES
    assert Patch.decode(data) == patch


def test_only_a_mesh_makes_a_frame_large() -> None:
    max_force = Neighbourhood.of(
        range(MAX_VERTICES), [(0.01, 0.0, 0.0)] * MAX_VERTICES, [0.004] * MAX_VERTICES
    )
    largest = replace(
        MESH, neighbourhood=max_force, compliance=Compliance3(*[0.001] * 3, *[0.0005] * 3)
    )
    assert MAX_FRAME_BYTES < len(largest.encode()) <= MAX_MESH_FRAME_BYTES
    assert Patch.decode(largest.encode()).neighbourhood == max_force
    assert len(PLANE.encode()) <= MAX_FRAME_BYTES


@given(
    st.lists(st.tuples(vectors(10.0), st.floats(0.0, 1.0)), max_size=MAX_VERTICES),
    st.floats(1e-6, 1.0),
)
def test_values_are_kept_to_a_fraction_of_the_largest(
    items: list[tuple[tuple[float, float, float], float]], size: float
) -> None:
    u = [(size * x, size * y, size * z) for (x, y, z), _ in items]
    c = [size * c for _, c in items]
    near = Neighbourhood.of(range(len(items)), u, c)
    near.encode()
    largest = max((abs(x) for v in u for x in v), default=0.0)
    for v, units in zip(u, near.displacements, strict=True):
        for x, unit in zip(v, units, strict=True):
            # The smallest of 32-bit numbers end the scale.
            assert near.scale * unit == pytest.approx(x, abs=largest / 60_000 + 1e-33)
    for x, unit in zip(c, near.compliances, strict=True):
        assert near.c_scale * unit == pytest.approx(x, abs=max(c) / 120_000 + 1e-33)


@given(st.binary(max_size=1200))
def test_any_bytes_give_a_neighbourhood_or_the_peers_error(data: bytes) -> None:
    try:
        Neighbourhood.decode(data).encode()
    except RemoteProtocolError:
        pass


@given(mesh_patches, st.data())
def test_a_damaged_frame_gives_a_valid_patch_or_the_peers_error(
    patch: Patch, data: st.DataObject
) -> None:
    frame = bytearray(patch.encode())
    frame[data.draw(st.integers(0, len(frame) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        Patch.decode(bytes(frame)).encode()
    except RemoteProtocolError:
        pass


@given(neighbourhoods, st.integers(-12, 12).filter(bool))
def test_a_tail_of_another_length_is_refused(near: Neighbourhood, more: int) -> None:
    data = near.encode()
    data = data + bytes(more) if more > 0 else data[:more]
    with pytest.raises(RemoteProtocolError, match="length of a neighbourhood"):
        Neighbourhood.decode(data)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"scale": -1e-6}, "scale of a neighbourhood is -1e-06"),
        ({"scale": float("nan")}, "scale of a neighbourhood is nan"),
        ({"c_scale": 1.0}, "c_scale of a neighbourhood is 1.0"),
        ({"indices": (3, 3, 9)}, "index of a vertex is 3; expected more than the one before, 3"),
        ({"indices": (3, 7, 65_536)}, "index of a vertex is 65536"),
        ({"indices": (-1, 7, 9)}, "index of a vertex is -1"),
        ({"displacements": ((40_000, 0, 0),) * 3}, "displacement of a vertex is 40000"),
        ({"compliances": (0, 0, -1)}, "compliance of a vertex is -1"),
    ],
)
def test_a_value_out_of_its_limits_is_a_local_error(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(LocalProtocolError, match=message):
        Neighbourhood.of_units(**UNITS | wrong).encode()


def test_vertices_in_disorder_are_the_peers_error() -> None:
    data = NEAR.encode()
    head, first, second = data[:10], data[10:20], data[20:30]
    for items in (second + first, first + first):
        bad = (2).to_bytes(2, "little") + head[2:] + items
        with pytest.raises(
            RemoteProtocolError, match=r"index of a vertex is .* than the one before"
        ):
            Neighbourhood.decode(bad)


@given(neighbourhoods)
def test_the_numbers_in_the_bytes_are_those_that_were_packed(near: Neighbourhood) -> None:
    again = Neighbourhood.of_units(
        near.scale, near.c_scale, near.indices, near.displacements, near.compliances
    )
    assert again == near
    assert len(near.items) == ITEM_SIZE * len(near.indices)


def test_too_many_vertices_are_named_from_both_sides() -> None:
    n = MAX_VERTICES + 1
    many = Neighbourhood.of(range(n), [(0.0, 0.0, 0.0)] * n, [0.0] * n)
    with pytest.raises(LocalProtocolError, match=f"vertices of a neighbourhood is {n}"):
        many.encode()
    head = n.to_bytes(2, "little") + bytes(8)
    with pytest.raises(RemoteProtocolError, match=f"vertices of a neighbourhood is {n}"):
        Neighbourhood.decode(head + bytes(10 * n))


def test_a_neighbourhood_belongs_to_a_mesh_and_to_nothing_else() -> None:
    with pytest.raises(LocalProtocolError, match="neighbourhood of a mesh patch is None"):
        replace(PLANE, geometry=Geometry.MESH).encode()
    with pytest.raises(LocalProtocolError, match="neighbourhood of a sphere patch"):
        replace(MESH, geometry=Geometry.SPHERE).encode()
    data = bytearray(MESH.encode())
    data[2] = data[2] & 0xF0 | Geometry.PLANE
    with pytest.raises(RemoteProtocolError, match=f"patch length is {len(data)}; expected {SIZE}"):
        Patch.decode(bytes(data))
