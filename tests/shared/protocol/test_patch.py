from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.frame import MAX_FRAME_BYTES
from cohaptic.protocol.patch import SIZE, Geometry, Patch
from tests.strategies import contact_samples, patches

GOOD = Patch(
    tick=1, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
    law=Law.PREDICTIVE, x_free=(0.1, 0.0, 0.0), normal=(1.0, 0.0, 0.0), curvature=0.0,
    k_o=250.0, k_o_coupled=150.0, c_ii=0.004, k_h=250.0,
    integral_gain=0.0, own_force=0.0, u_others=0.0,
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
    with pytest.raises(RemoteProtocolError, match="protocol version is 9; expected 2"):
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
