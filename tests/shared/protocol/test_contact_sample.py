from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.hand_model import USUAL_HAND
from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.contact_sample import SIZE, SIZES, ContactSample
from cohaptic.protocol.frame import MAX_FRAME_BYTES
from cohaptic.vec import Vec3
from tests.strategies import contact_samples

GOOD = ContactSample(seq=1, tick=0, t_client=1.0, probe=(0.1, 0.0, 0.0), force=(1.0, 0.0, 0.0))


def test_is_within_the_agreed_size() -> None:
    assert SIZE == len(GOOD.encode()) <= MAX_FRAME_BYTES


@given(contact_samples)
def test_comes_back_as_it_was(sample: ContactSample) -> None:
    assert ContactSample.decode(sample.encode()) == sample


@given(st.binary(max_size=200))
def test_any_bytes_give_a_sample_or_the_peers_error(data: bytes) -> None:
    try:
        ContactSample.decode(data)
    except RemoteProtocolError:
        pass


@given(contact_samples, st.integers(0, SIZE - 1), st.integers(1, 255))
def test_a_damaged_frame_gives_a_valid_sample_or_the_peers_error(
    sample: ContactSample, at: int, flip: int
) -> None:
    data = bytearray(sample.encode())
    data[at] ^= flip
    try:
        ContactSample.decode(bytes(data)).encode()
    except RemoteProtocolError:
        pass


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("offset", range(20, 44, 4))
def test_a_number_that_is_none_is_named(bad: float, offset: int) -> None:
    data = bytearray(GOOD.encode())
    struct.pack_into("<f", data, offset, bad)
    with pytest.raises(RemoteProtocolError, match=r"(probe|force|length of).*(nan|inf)"):
        ContactSample.decode(bytes(data))


def test_an_absurd_position_names_value_and_limit() -> None:
    data = bytearray(GOOD.encode())
    struct.pack_into("<f", data, 20, 1000.0)
    with pytest.raises(RemoteProtocolError, match=r"length of probe is '1000 m'; expected <= 10"):
        ContactSample.decode(bytes(data))


def test_an_absurd_force_names_value_and_limit() -> None:
    data = bytearray(GOOD.encode())
    struct.pack_into("<f", data, 32, 5000.0)
    with pytest.raises(RemoteProtocolError, match=r"length of force is '5000 N'; expected <= 100"):
        ContactSample.decode(bytes(data))


@pytest.mark.parametrize("length", [0, 3, SIZE - 1, SIZE + 1, 127])
def test_a_wrong_length_names_value_and_limit(length: int) -> None:
    data = (GOOD.encode() + bytes(128))[:length]
    with pytest.raises(RemoteProtocolError, match=rf"is {length}; expected"):
        ContactSample.decode(data)


def test_an_absurd_anchor_names_value_and_limit() -> None:
    data = bytearray(GOOD._replace(anchor=(0.1, 0.0, 0.0)).encode())
    assert len(data) == SIZES[1]
    struct.pack_into("<f", data, 44, 1000.0)
    with pytest.raises(RemoteProtocolError, match=r"length of anchor is '1000 m'; expected <= 10"):
        ContactSample.decode(bytes(data))


@pytest.mark.parametrize("anchor", [None, (0.1, 0.0, 0.0)])
@pytest.mark.parametrize("deflection", [10.1, -10.1, math.nan, math.inf, -math.inf])
def test_an_absurd_deflection_is_named_whoever_sends_it(
    anchor: Vec3 | None, deflection: float
) -> None:
    data = bytearray(GOOD._replace(anchor=anchor, deflection=0.01).encode())
    assert len(data) == SIZES[3 if anchor else 2] <= MAX_FRAME_BYTES
    struct.pack_into("<f", data, len(data) - 4, deflection)
    with pytest.raises(RemoteProtocolError, match=r"^deflection is .*; expected from -10 to 10"):
        ContactSample.decode(bytes(data))
    with pytest.raises(LocalProtocolError, match=r"^deflection is .*; expected from -10 to 10"):
        GOOD._replace(anchor=anchor, deflection=deflection).encode()


@pytest.mark.parametrize(
    ("flags", "size"),
    [
        *[(flags, size) for flags in SIZES for size in SIZES.values() if size != SIZES[flags]],
        *[(flags, size) for flags in (4, 5, 8) for size in SIZES.values()],
    ],
)
def test_an_anchor_or_give_is_there_where_the_flags_say_so(flags: int, size: int) -> None:
    data = bytearray((GOOD.encode() + bytes(64))[:size])
    struct.pack_into("<H", data, 2, flags)
    with pytest.raises(RemoteProtocolError, match=r"length is \d+; expected|flags of a contact"):
        ContactSample.decode(bytes(data))


@pytest.mark.parametrize("anchor", [None, (0.1, 0.0, 0.0)])
@pytest.mark.parametrize(
    ("name", "offset", "values"),
    [
        ("mass", 12, (0.029, 0.81, 0.0, -1.0, math.nan)),
        ("damping", 8, (0.49, 100.1, 0.0, math.inf)),
        ("stiffness", 4, (49.0, 10001.0, -math.inf)),
    ],
)
def test_an_absurd_hand_is_named_whoever_sends_it(
    anchor: Vec3 | None, name: str, offset: int, values: tuple[float, ...]
) -> None:
    reported = GOOD._replace(anchor=anchor, deflection=0.01, own_model=USUAL_HAND)
    data = bytearray(reported.encode())
    assert len(data) == SIZES[7 if anchor else 6] <= MAX_FRAME_BYTES
    for value in values:
        struct.pack_into("<f", data, len(data) - offset, value)
        with pytest.raises(RemoteProtocolError, match=f"^{name} of a model is "):
            ContactSample.decode(bytes(data))
        with pytest.raises(LocalProtocolError, match=f"^{name} of a model is "):
            reported._replace(own_model=USUAL_HAND._replace(**{name: value})).encode()


def test_a_hand_is_not_sent_without_its_give() -> None:
    with pytest.raises(LocalProtocolError, match=r"^deflection beside a model is None"):
        GOOD._replace(own_model=USUAL_HAND).encode()


def test_our_own_mistake_is_ours() -> None:
    with pytest.raises(LocalProtocolError):
        ContactSample(0, 0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)).encode()
