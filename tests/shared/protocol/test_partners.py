"""The other hands in a patch: there and back, limits on both sides, and bytes that are none."""

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
from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.frame import MAX_MESH_FRAME_BYTES
from cohaptic.protocol.layout import COUPLED, PARTNER, PARTNERS
from cohaptic.protocol.neighbourhood import MAX_VERTICES, Neighbourhood
from cohaptic.protocol.partners import HEAVIEST, LIGHTEST, MAX_PARTNERS, Partner, Partners
from cohaptic.protocol.patch import SIZE, Geometry, Patch
from tests.client.plane import PLANE
from tests.strategies import mesh_patches, partners, patches

MODEL = HandModel(0.125, 8.0, 400.0)
FIRST = Partner(7, MODEL, 0.015625, 0.0078125, 2.5, 10.0, 0.00390625, (0.001953125,))
SECOND = Partner(9, MODEL, -0.25, 0.0, 0.0, 5.0, 0.0078125, (0.0, -0.0009765625))
GOOD = Partners(0.5, 10.0, MODEL, (FIRST, SECOND))
COMPLIANCE = Compliance3(*[0.004] * 3, *[0.001] * 3)
# Offset of the first byte behind each partner [B].
ENDS = [PARTNERS.size]
for _j in range(MAX_PARTNERS):
    ENDS.append(ENDS[-1] + PARTNER.size + (_j + 1) * COUPLED.size)

with_partners = st.builds(replace, patches | mesh_patches, partners=partners)


@given(with_partners)
def test_a_patch_with_partners_comes_back_as_it_was(patch: Patch) -> None:
    """Of every geometry, with compliance and neighbourhood and without."""
    data = patch.encode()
    assert len(data) <= MAX_MESH_FRAME_BYTES
    assert Patch.decode(data) == patch == Patch.decode_checked(data)


@given(patches | mesh_patches, partners)
def test_partners_add_their_own_bytes_and_change_no_others(patch: Patch, others: Partners) -> None:
    plain, data = patch.encode(), replace(patch, partners=others).encode()
    start = SIZE if patch.compliance is None else SIZE + 24
    part = others.encode()
    assert len(part) == ENDS[len(others.partners)]
    assert data[4:start] == plain[4:start]
    assert data[start:] == part + plain[start:]


@given(partners, st.binary(max_size=20), st.binary(max_size=20))
def test_the_part_is_found_at_its_offset(others: Partners, before: bytes, behind: bytes) -> None:
    part = others.encode()
    found, end = Partners.decode(before + part + behind, len(before))
    assert found == others
    assert end == len(before) + len(part)


def test_the_largest_patch_fits() -> None:
    """docs/protocol.md: seven partners take 384 bytes, beside 97 vertices and a compliance."""
    max_force = Neighbourhood.of(
        range(MAX_VERTICES), [(0.01, 0.0, 0.0)] * MAX_VERTICES, [0.004] * MAX_VERTICES
    )
    others = Partners(
        1.0,
        10.0,
        MODEL,
        tuple(FIRST._replace(user=j + 1, coupled=(0.0,) * (j + 1)) for j in range(MAX_PARTNERS)),
    )
    largest = replace(
        PLANE,
        geometry=Geometry.MESH,
        neighbourhood=max_force,
        compliance=COMPLIANCE,
        partners=others,
    )
    assert len(others.encode()) == 388
    assert len(largest.encode()) <= MAX_MESH_FRAME_BYTES
    found = Patch.decode(largest.encode())
    assert (found.partners, found.neighbourhood) == (others, max_force)


def test_users_are_named_in_the_order_of_the_partners() -> None:
    assert GOOD.users == (7, 9)


@pytest.mark.parametrize("model", [LIGHTEST, HEAVIEST])
def test_32_bits_round_no_limit_of_a_model_out_of_it(model: HandModel) -> None:
    edge = FIRST._replace(model=model, c_jj=1e-6)
    patch = replace(PLANE, partners=Partners(1.0, 10.0, model, (edge, edge._replace(c_jj=10.0,
                    user=8, coupled=(10.0, -10.0)))))  # fmt: skip
    found = Patch.decode(patch.encode()).partners
    assert found is not None
    assert found.model == pytest.approx(model, rel=1e-6)
    assert found.partners[0].c_jj == pytest.approx(1e-6, rel=1e-6)


# Name, change of the first partner or of the whole, offset [B] in this part, and kind.
BEYOND: list[tuple[str, dict[str, Any], int, str, float]] = [
    ("weight of the models", {"weight": -0.1}, 4, "f", -0.1),
    ("weight of the models", {"weight": 1.1}, 4, "f", 1.1),
    *[
        (f"{name} of a model", {name: value}, at + 4 * i, "f", value)
        for at in (12, PARTNERS.size + 4)
        for i, (name, low, high) in enumerate(
            zip(HandModel._fields, LIGHTEST, HEAVIEST, strict=True)
        )
        for value in (0.99 * low, 1.01 * high, 0.0, -high)
    ],
    ("user of a partner", {"user": 0}, 24, "I", 0),
    ("depth of a partner", {"intended": 20.1}, 40, "f", 20.1),
    ("depth of a partner", {"intended": -20.1}, 40, "f", -20.1),
    ("deflection of a partner", {"deflection": 10.1}, 44, "f", 10.1),
    ("deflection of a partner", {"deflection": -10.1}, 44, "f", -10.1),
    ("force of a partner", {"force": -0.1}, 48, "f", -0.1),
    ("force of a partner", {"force": 301.0}, 48, "f", 301.0),
    ("largest force of a partner", {"max_force": -0.1}, 52, "f", -0.1),
    ("largest force of a partner", {"max_force": 101.0}, 52, "f", 101.0),
    ("c_jj of a partner", {"c_jj": 0.0}, 56, "f", 0.0),
    ("c_jj of a partner", {"c_jj": 0.9e-6}, 56, "f", 0.9e-6),
    ("c_jj of a partner", {"c_jj": 10.1}, 56, "f", 10.1),
    ("compliance", {"coupled": (10.1,)}, 60, "f", 10.1),
    ("compliance", {"coupled": (-10.1,)}, 60, "f", -10.1),
]


@pytest.mark.parametrize(("name", "change", "at", "kind", "value"), BEYOND)
def test_no_number_is_beyond_its_limits_whoever_sends_it(
    name: str, change: dict[str, Any], at: int, kind: str, value: float
) -> None:
    data = bytearray(replace(PLANE, partners=GOOD).encode())
    for bad in (value, math.nan) if kind == "f" else (value,):
        struct.pack_into(f"<{kind}", data, SIZE + at, bad)
        with pytest.raises(RemoteProtocolError, match=f"^{name}"):
            Patch.decode(bytes(data))
        change = {key: (bad,) if key == "coupled" else bad for key in change}
        with pytest.raises(LocalProtocolError, match=f"^{name}"):
            replace(PLANE, partners=changed(change, own_model=at < PARTNERS.size)).encode()


def changed(change: dict[str, Any], *, own_model: bool) -> Partners:
    """`GOOD` with another value in it."""
    if "weight" in change:
        return Partners(change["weight"], 10.0, MODEL, GOOD.partners)
    if set(change) <= set(HandModel._fields):
        model = MODEL._replace(**change)
        if own_model:
            return Partners(0.5, 10.0, model, GOOD.partners)
        change = {"model": model}
    return Partners(0.5, 10.0, MODEL, (FIRST._replace(**change), SECOND))


@pytest.mark.parametrize("at", [4, 8, 36, 44, 52, 56])
@pytest.mark.parametrize("bad", [math.inf, -math.inf])
def test_no_number_is_infinite(at: int, bad: float) -> None:
    data = bytearray(replace(PLANE, partners=GOOD).encode())
    struct.pack_into("<f", data, SIZE + at, bad)
    with pytest.raises(RemoteProtocolError, match="expected from"):
        Patch.decode(bytes(data))


@pytest.mark.parametrize("count", [MAX_PARTNERS + 1, 9, 0xFFFF])
def test_more_partners_than_a_patch_carries_are_refused(count: int) -> None:
    data = bytearray(replace(PLANE, partners=GOOD).encode() + bytes(4000))
    struct.pack_into("<H", data, SIZE, count)
    with pytest.raises(RemoteProtocolError, match=f"partners of a patch is {count}"):
        Patch.decode(bytes(data))
    with pytest.raises(LocalProtocolError, match="partners of a patch is 8"):
        Partners(1.0, 10.0, MODEL, (FIRST,) * (MAX_PARTNERS + 1)).encode()


@pytest.mark.parametrize("length", [0, 1, 3])
def test_a_row_of_another_length_is_our_mistake(length: int) -> None:
    """The bytes would say something else to the peer, or nothing."""
    wrong = Partners(1.0, 10.0, MODEL, (FIRST, SECOND._replace(coupled=(0.0,) * length)))
    with pytest.raises(LocalProtocolError, match="compliances of a partner"):
        wrong.encode()


@given(with_partners, st.data())
def test_a_shorter_frame_is_the_peers_error(patch: Patch, data: st.DataObject) -> None:
    frame = patch.encode()
    cut = data.draw(st.integers(0, len(frame) - 1))
    with pytest.raises(RemoteProtocolError):
        Patch.decode(frame[:cut])


@given(with_partners, st.binary(min_size=1, max_size=9))
def test_a_longer_frame_is_the_peers_error(patch: Patch, more: bytes) -> None:
    with pytest.raises(RemoteProtocolError):
        Patch.decode(patch.encode() + more)


@given(with_partners, st.data())
def test_a_damaged_frame_gives_a_valid_patch_or_the_peers_error(
    patch: Patch, data: st.DataObject
) -> None:
    frame = bytearray(patch.encode())
    # Mostly in this part: the rest of a patch has tests of its own.
    first = SIZE if data.draw(st.booleans()) else 0
    frame[data.draw(st.integers(first, len(frame) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        found = Patch.decode(bytes(frame))
    except RemoteProtocolError:
        return
    found.encode()


@given(st.integers(1, 3), st.booleans(), st.binary(max_size=600))
def test_any_bytes_behind_a_patch_give_a_valid_patch_or_the_peers_error(
    geometry: int, rough: bool, tail: bytes
) -> None:
    data = bytearray(replace(PLANE, compliance=COMPLIANCE).encode()[: SIZE + 24 * rough] + tail)
    flags = struct.unpack_from("<H", data, 2)[0] & 0xF0 | geometry | 0x100 * rough | 0x200
    struct.pack_into("<H", data, 2, flags)
    try:
        found = Patch.decode(bytes(data))
    except RemoteProtocolError:
        return
    found.encode()


def test_a_flag_beyond_that_of_partners_is_refused() -> None:
    data = bytearray(replace(PLANE, partners=GOOD).encode())
    data[3] |= 0x04
    with pytest.raises(RemoteProtocolError, match="flags of a patch"):
        Patch.decode(bytes(data))
