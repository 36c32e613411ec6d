from __future__ import annotations

import math
import struct
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.hand_model import HandModel
from cohaptic.control.law import Law
from cohaptic.control.room_lag import RoomLag
from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.frame import MAX_FRAME_BYTES
from cohaptic.protocol.partners import Partners
from cohaptic.protocol.patch import (
    MAX_COUPLING,
    MAX_LAG,
    MAX_MARGIN,
    MIN_COMPLIANCE,
    SIZE,
    Geometry,
    Patch,
)
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import ZERO
from tests.strategies import contact_samples, patches

GOOD = Patch(
    tick=1, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
    law=Law.PREDICTIVE, x_free=(0.1, 0.0, 0.0), normal=(1.0, 0.0, 0.0), curvature=0.0,
    c_ii=0.004, k_h=250.0, integral_gain=0.0, own_force=ZERO, u_others=ZERO,
)  # fmt: skip


@given(patches)
def test_comes_back_as_it_was(patch: Patch) -> None:
    data = patch.encode()
    extra = 0 if patch.compliance is None else 24
    assert len(data) == SIZE + extra <= MAX_FRAME_BYTES
    assert Patch.decode(data) == patch


@given(st.binary(max_size=200))
def test_any_bytes_give_a_patch_or_the_peers_error(data: bytes) -> None:
    try:
        Patch.decode(data)
    except RemoteProtocolError:
        pass


@given(patches, st.integers(0, SIZE - 1), st.integers(1, 255))
def test_a_damaged_frame_gives_a_valid_patch_or_the_peers_error(
    patch: Patch, at: int, flip: int
) -> None:
    data = bytearray(patch.encode())
    data[at] ^= flip
    try:
        Patch.decode(bytes(data)).encode()
    except RemoteProtocolError:
        pass


def test_the_other_versions_frames_are_named() -> None:
    data = bytes([9]) + GOOD.encode()[1:]
    expected = f"protocol version is 9; expected {PROTOCOL_VERSION}"
    with pytest.raises(RemoteProtocolError, match=expected):
        Patch.decode(data)


@given(contact_samples)
def test_the_other_kind_of_frame_is_named(sample: ContactSample) -> None:
    with pytest.raises(RemoteProtocolError, match=r"frame kind is 1; expected 2 \(patch\)"):
        Patch.decode(sample.encode())


def test_an_unknown_geometry_is_named() -> None:
    data = bytearray(GOOD.encode())
    data[2] = 9
    with pytest.raises(RemoteProtocolError, match="geometry of a patch is 9"):
        Patch.decode(bytes(data))


def test_a_normal_that_is_not_one_is_our_mistake() -> None:
    with pytest.raises(LocalProtocolError, match="length of normal"):
        replace(GOOD, normal=(2.0, 0.0, 0.0)).encode()


def test_is_as_large_as_is_written() -> None:
    """docs/protocol.md; with friction six numbers more."""
    assert len(GOOD.encode()) == SIZE == 116
    assert len(replace(GOOD, compliance=Compliance3(*[0.004] * 3, *[0.001] * 3)).encode()) == 140


def test_partners_are_within_the_frame_that_a_plane_without_them_ends() -> None:
    """Their own tests are in `test_partners.py`."""
    model = HandModel(0.125, 8.0, 400.0)
    none = replace(GOOD, partners=Partners(0.5, 10.0, model, ()))
    assert len(none.encode()) == SIZE + 24
    assert Patch.decode(none.encode()).partners == none.partners
    assert Patch.decode(GOOD.encode()).partners is None


@given(patches)
def test_the_stiffness_alone_is_one_over_the_compliance(patch: Patch) -> None:
    assert patch.k_o * patch.c_ii == pytest.approx(1.0, rel=1e-12)


def test_a_room_that_nothing_couples_is_as_far_from_the_edge_as_can_be_said() -> None:
    assert GOOD.room.margin == math.inf
    assert Patch.decode(GOOD.encode()).room == RoomLag(0.0, 0.0, MAX_MARGIN)


def test_a_fixed_part_comes_back_with_the_least_compliance() -> None:
    """32 bits may round it to a little less than the limit."""
    held = replace(GOOD, c_ii=MIN_COMPLIANCE)
    assert Patch.decode(held.encode()).c_ii == pytest.approx(MIN_COMPLIANCE, rel=1e-6)


# Field, where it is in the frame, one number beyond each bound; none of them is one.
BOUNDS: list[tuple[str, str, int, float]] = [
    ("sample_wait", "f", 28, -1.0),
    ("sample_wait", "f", 28, 2e6),
    *[("x_free", "f", 32 + 4 * axis, 11.0) for axis in range(3)],
    *[("normal", "f", 44 + 4 * axis, 2.0) for axis in range(3)],
    ("curvature", "f", 56, 2e4),
    ("curvature", "f", 56, -2e4),
    ("c_ii", "f", 60, 0.0),
    ("c_ii", "f", 60, 0.9 * MIN_COMPLIANCE),
    ("c_ii", "f", 60, 11.0),
    ("k_h", "f", 64, -1.0),
    ("k_h", "f", 64, 2e6),
    ("integral_gain", "f", 68, -1.0),
    ("integral_gain", "f", 68, 2e9),
    *[("own_force", "f", 72 + 4 * axis, 1001.0) for axis in range(3)],
    *[("u_others", "f", 84 + 4 * axis, -11.0) for axis in range(3)],
    ("lag of the room", "f", 96, -0.1),
    ("lag of the room", "f", 96, 2.0 * MAX_LAG),
    ("coupling of the room", "e", 100, -0.1),
    ("coupling of the room", "e", 100, 2.0 * MAX_COUPLING),
    ("margin of the room", "e", 102, -0.1),
    *[("entry of a tick's ledger", "e", 104 + 2 * entry, 301.0) for entry in range(5)],
    ("gain_cut", "e", 114, -1.0),
    ("gain_cut", "e", 114, 6.1e4),
    *[("compliance", "f", 116 + 4 * entry, 11.0) for entry in range(6)],
]


@pytest.mark.parametrize(("name", "kind", "at", "value"), BOUNDS)
@pytest.mark.parametrize("bad", [None, math.nan])
def test_no_number_of_a_patch_is_beyond_its_bounds(
    name: str, kind: str, at: int, value: float, bad: float | None
) -> None:
    """A client that believed it would be a danger to its hand."""
    data = bytearray(replace(GOOD, compliance=Compliance3(*[0.004] * 3, *[0.001] * 3)).encode())
    struct.pack_into(f"<{kind}", data, at, value if bad is None else bad)
    with pytest.raises(RemoteProtocolError, match=name):
        Patch.decode(bytes(data))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"c_ii": 0.0}, "c_ii"),
        ({"k_h": math.inf}, "k_h"),
        ({"curvature": 1e5}, "curvature"),
        ({"own_force": (0.0, math.nan, 0.0)}, "own_force"),
        ({"u_others": (0.0, 0.0, 20.0)}, "u_others"),
        ({"room": RoomLag(2.0 * MAX_LAG, 1.0, 1.0)}, "lag of the room"),
        ({"room": RoomLag(0.0, 2.0 * MAX_COUPLING, 1.0)}, "coupling of the room"),
        ({"compliance": Compliance3(0.0, 0.0, 20.0, 0.0, 0.0, 0.0)}, "compliance"),
        ({"compliance": Compliance3(1.0, 1.0, 1.0, 0.0, 1.05, 0.0)}, "positive definite"),
    ],
)
def test_we_send_none_either(change: dict[str, Any], words: str) -> None:
    with pytest.raises(LocalProtocolError, match=words):
        replace(GOOD, **change).encode()
