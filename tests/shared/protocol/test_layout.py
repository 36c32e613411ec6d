"""The table of frames: it fits the values that the codecs take, and the written frames."""

from __future__ import annotations

import dataclasses
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cohaptic.control.hand_model import HandModel
from cohaptic.control.room_lag import RoomLag
from cohaptic.control.tick_ledger import TickLedger
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.fields import HEAD, FrameKind, Layout
from cohaptic.protocol.layout import (
    ACK,
    ANCHOR,
    BOX,
    COMPLIANCE,
    CONTACT_SAMPLE,
    COUPLED,
    DEFLECTION,
    LAYOUTS,
    NEIGHBOUR,
    NEIGHBOURHOOD,
    OWN_MODEL,
    PARTNER,
    PARTNERS,
    PATCH,
    REST_MESH,
    SCENE,
    SURFACE,
    USER,
)
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.partners import Partner, Partners
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.scene_surface import Surface
from cohaptic.protocol.scene_users import UserRecord
from cohaptic.protocol.version import PROTOCOL_VERSION

VECTORS = Path(__file__).parents[2] / "vectors"


def names(layout: Layout) -> set[str]:
    """Names of a layout's values: one for each group, and none for padding."""
    return {field.group or field.name for field in layout.fields if field.type != "pad"}


def members(kind: type[Any]) -> set[str]:
    return {field.name for field in dataclasses.fields(kind)}


def test_every_kind_has_one_frame() -> None:
    frames = [layout.frame for layout in LAYOUTS if layout.frame is not None]
    assert [frame.kind for frame in frames] == list(FrameKind)
    assert len({layout.name for layout in LAYOUTS}) == len(LAYOUTS)


@pytest.mark.parametrize(
    ("layouts", "kept"),
    [
        (
            (CONTACT_SAMPLE, ANCHOR, DEFLECTION, OWN_MODEL),
            set(ContactSample._fields) - {"own_model"} | set(HandModel._fields),
        ),
        # Geometry and law are in the flags of a patch; partners and neighbourhood are behind it.
        ((PATCH, COMPLIANCE), members(Patch) - {"geometry", "law", "partners", "neighbourhood"}),
        ((PARTNERS,), members(Partners) - {"model", "partners"} | {"count", *HandModel._fields}),
        ((PARTNER, COUPLED), set(Partner._fields) - {"model"} | set(HandModel._fields)),
        ((REST_MESH,), members(RestMesh)),
        ((BOX,), members(QuantisedMesh) - {"places", "faces"}),
        ((SCENE,), members(Scene) - {"surface"}),
        ((ACK,), members(Ack)),
    ],
)
def test_each_value_of_a_message_has_a_field(layouts: tuple[Layout, ...], kept: set[str]) -> None:
    assert set[str]().union(*map(names, layouts)) == kept


def test_each_value_of_a_part_has_a_field() -> None:
    in_bytes = {"law", "geometry", "fresh", "friction"}
    reported = names(USER) - {"shape", "state", "to_free"} | {"x_free"}
    assert reported == members(UserRecord) - in_bytes
    assert all(f"`{name}`" in "".join(f.meaning for f in USER.fields) for name in in_bytes)
    assert names(NEIGHBOURHOOD) - {"count"} == members(Neighbourhood) - {"items"}
    assert all(hasattr(Neighbourhood, name) for name in names(NEIGHBOUR))
    assert names(SURFACE) - {"length"} == members(Surface) - {"units"}
    for layout in (PATCH, SCENE):
        assert {f.name for f in layout.fields if f.group == "room"} == members(RoomLag)
    for layout in (PATCH, USER):
        assert {f.name for f in layout.fields if f.group == "ledger"} == members(TickLedger)


def written(layout: Layout) -> Iterator[tuple[bytes, dict[str, Any]]]:
    for vector in json.loads((VECTORS / f"{layout.name}.json").read_text(encoding="utf-8")):
        yield bytes.fromhex(vector["hex"]), vector["fields"]


@pytest.mark.parametrize("layout", [CONTACT_SAMPLE, PATCH, SCENE, ACK], ids=lambda one: one.name)
def test_each_field_of_a_written_frame_lies_where_the_table_says(layout: Layout) -> None:
    for data, values in written(layout):
        for offset, field in zip(layout.offsets, layout.all_fields, strict=True):
            found = struct.unpack_from(f"<{field.code}", data, offset)
            where = values[field.group] if field.group else values
            if field in HEAD.fields:
                assert layout.frame is not None
                expected = {"version": PROTOCOL_VERSION, "kind": layout.frame.kind}
                assert field.name == "flags" or found == (expected[field.name],)
            elif field.type == "pad":
                assert data[offset : offset + field.size] == bytes(field.size)
            elif field.name == "users":
                assert found == (len(where["users"]),)
            elif (field.name, where[field.name]) != ("margin", None):  # JSON has no infinity
                value = where[field.name]
                assert list(found) == (value if field.numbers > 1 else [value]), field.name


def test_each_part_of_a_written_frame_lies_where_the_table_says() -> None:
    seen = set[str]()
    for data, values in written(CONTACT_SAMPLE):
        if values["anchor"] is not None:
            seen.add("anchor")
            assert list(ANCHOR.packer().unpack_from(data, CONTACT_SAMPLE.size)) == values["anchor"]
        if values["deflection"] is not None:
            seen.add("deflection")
            at = CONTACT_SAMPLE.size + (ANCHOR.size if values["anchor"] else 0)
            assert DEFLECTION.packer().unpack_from(data, at) == (values["deflection"],)
    for data, values in written(PATCH):
        at = PATCH.size
        if values["compliance"] is not None:
            seen.add("compliance")
            assert list(COMPLIANCE.packer().unpack_from(data, at)) == values["compliance"]
            at += COMPLIANCE.size
        if values["partners"] is not None:
            seen.add("partners")
            at = read_partners(data, at, values["partners"])
        if values["neighbourhood"] is not None:
            seen.add("neighbourhood")
            near = values["neighbourhood"]
            head = [len(near["indices"]), near["scale"], near["c_scale"]]
            assert list(NEIGHBOURHOOD.packer().unpack_from(data, at)) == head
            items = list(NEIGHBOUR.packer().iter_unpack(data[at + NEIGHBOURHOOD.size :]))
            rows = zip(near["indices"], near["displacements"], near["compliances"], strict=True)
            assert items == [(i, *u, c) for i, u, c in rows]
    assert seen == {"anchor", "deflection", "compliance", "partners", "neighbourhood"}


def read_partners(data: bytes, at: int, values: dict[str, Any]) -> int:
    """Compare the partners in a frame; return the offset behind them."""
    others = values["partners"]
    head = (len(others), values["weight"], values["max_force"], *values["model"].values())
    assert PARTNERS.packer().unpack_from(data, at) == head
    at += PARTNERS.size
    for one in others:
        names = [field.name for field in PARTNER.fields]
        item = tuple({**one, **one["model"]}[name] for name in names)
        assert PARTNER.packer().unpack_from(data, at) == item
        at += PARTNER.size
        for c in one["coupled"]:
            assert COUPLED.packer().unpack_from(data, at) == (c,)
            at += COUPLED.size
    return at
