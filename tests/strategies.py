"""Hypothesis strategies that several tests use."""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.hand_model import HandModel
from cohaptic.control.law import Law
from cohaptic.control.room_lag import RoomLag
from cohaptic.control.tick_ledger import TickLedger
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.neighbourhood import MAX_VERTICES, Neighbourhood
from cohaptic.protocol.partners import (
    HEAVIEST,
    LIGHTEST,
    MAX_CARRIED,
    MAX_PARTNERS,
    Partner,
    Partners,
)
from cohaptic.protocol.patch import (
    MAX_COMPLIANCE,
    MAX_COUPLING,
    MAX_GAIN_CUT,
    MAX_LAG,
    MAX_MARGIN,
    MIN_COMPLIANCE,
    Geometry,
    Patch,
)
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.scene_surface import Surface
from cohaptic.protocol.scene_users import UserRecord
from cohaptic.vec import Vec3, add, unit


def single(x: float) -> float:
    """The nearest number that survives the wire's 32 bits."""
    return float(struct.unpack("<f", struct.pack("<f", x))[0])


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(single(low), single(high), width=32)


def vectors(limit: float) -> st.SearchStrategy[Vec3]:
    part = floats(-limit / 2, limit / 2)
    return st.tuples(part, part, part)


counts = st.integers(1, 2**32 - 1)
times = st.floats(-1e9, 1e9)
# On the wire a normal has 32 bits per component and stays within a thousandth of unit length.
normals = (
    vectors(1.0).map(lambda v: tuple(single(c) for c in unit(v))).map(lambda v: (v[0], v[1], v[2]))
)

hand_models = st.builds(
    HandModel, *[floats(low, high) for low, high in zip(LIGHTEST, HEAVIEST, strict=True)]
)
_tellings = st.tuples(st.floats(-10.0, 10.0, width=32), st.none() | hand_models)


def _sample(reported: tuple[float | None, HandModel | None], **fields: Any) -> ContactSample:
    return ContactSample(**fields, deflection=reported[0], own_model=reported[1])


contact_samples = st.builds(
    _sample,
    st.just((None, None)) | _tellings,
    seq=counts,
    tick=st.integers(0, 2**32 - 1),
    t_client=times,
    probe=vectors(10.0),
    force=vectors(100.0),
    anchor=st.none() | vectors(10.0),
)

# Values of a room that survive 16 bits.
rooms = st.builds(
    RoomLag,
    lag=floats(0.0, MAX_LAG),
    coupling=st.floats(0.0, MAX_COUPLING, width=16),
    margin=st.floats(0.0, MAX_MARGIN, width=16),
)
ledgers = st.builds(
    TickLedger,
    *[st.floats(-300.0, 300.0, width=16)] * 5,
    gain_cut=st.floats(0.0, MAX_GAIN_CUT, width=16),
)
patches = st.builds(
    Patch,
    tick=counts,
    seq=st.integers(0, 2**32 - 1),
    t_server=times,
    t_client=times,
    sample_wait=floats(0.0, 100.0),
    geometry=st.sampled_from((Geometry.PLANE, Geometry.SPHERE)),
    law=st.sampled_from(Law),
    x_free=vectors(10.0),
    normal=normals,
    curvature=floats(-100.0, 100.0),
    c_ii=floats(MIN_COMPLIANCE, 1.0),
    k_h=floats(0.0, 1e5),
    integral_gain=floats(0.0, 1e6),
    own_force=vectors(100.0),
    u_others=vectors(1.0),
    room=rooms,
    ledger=ledgers,
    compliance=st.none()
    # Positive definite: no row's entries beside the diagonal reach its own.
    | st.builds(Compliance3, *[floats(0.125, 1.0)] * 3, *[floats(-0.0625, 0.0625)] * 3),
)


def as_partner(user: int, j: int) -> st.SearchStrategy[Partner]:
    """The partner with this number, at place `j` of a patch."""
    return st.builds(
        Partner,
        user=st.just(user),
        model=hand_models,
        intended=floats(-20.0, 20.0),
        deflection=floats(-10.0, 10.0),
        force=floats(0.0, MAX_CARRIED),
        max_force=floats(0.0, 100.0),
        c_jj=floats(MIN_COMPLIANCE, MAX_COMPLIANCE),
        coupled=st.tuples(*[floats(-10.0, 10.0)] * (j + 1)),
    )


partners = st.lists(counts, max_size=MAX_PARTNERS, unique=True).flatmap(
    lambda users: st.builds(
        Partners,
        weight=floats(0.0, 1.0),
        max_force=floats(0.0, 100.0),
        model=hand_models,
        partners=st.tuples(*[as_partner(user, j) for j, user in enumerate(users)]),
    )
)

shorts = st.integers(-(2**15), 2**15 - 1)
neighbourhoods = st.sets(st.integers(0, 2**16 - 1), max_size=MAX_VERTICES).flatmap(
    lambda chosen: st.builds(
        Neighbourhood.of_units,
        scale=floats(0.0, 3e-4),
        c_scale=floats(0.0, 1e-4),
        indices=st.just(tuple(sorted(chosen))),
        displacements=st.tuples(*[st.tuples(shorts, shorts, shorts)] * len(chosen)),
        compliances=st.tuples(*[st.integers(0, 2**16 - 1)] * len(chosen)),
    )
)


def as_mesh(patch: Patch, near: Neighbourhood) -> Patch:
    return replace(patch, geometry=Geometry.MESH, neighbourhood=near)


mesh_patches = st.builds(as_mesh, patches, neighbourhoods)

rest_meshes = st.lists(vectors(10.0), min_size=3, max_size=12).flatmap(
    lambda vertices: st.builds(
        RestMesh,
        vertices=st.just(tuple(vertices)),
        faces=st.lists(
            st.tuples(*[st.integers(0, len(vertices) - 1)] * 3), min_size=1, max_size=20
        ).map(tuple),
    )
)


acks = st.builds(Ack, tick=counts, wants=st.integers(0, 1))

# In a scene a normal has 16 bits per component.
coarse_normals = normals.map(lambda v: tuple(round(32767 * c) / 32767 for c in v)).map(
    lambda v: (v[0], v[1], v[2])
)
halves = st.floats(-6e4, 6e4, width=16)


def _record(to_free: Vec3, **fields: Any) -> UserRecord:
    """A record as it comes over the wire, on which the contact point is told from the tip."""
    return UserRecord(**fields, x_free=add(fields["probe"], to_free))


_near = st.floats(-0.5, 0.5, width=16)
user_records = st.builds(
    _record,
    to_free=st.tuples(_near, _near, _near),
    user=counts,
    probe=vectors(9.0),
    foot=vectors(10.0),
    force=vectors(100.0),
    c_ii=st.floats(0.0, 1.0, width=16),
    k_o_coupled=floats(0.0, 1e5),
    k_h=floats(0.0, 1e5),
    integral_gain=floats(0.0, 1e6),
    loop_delay=st.floats(0.0, 10.0, width=16),
    normal=coarse_normals,
    law=st.sampled_from(Law),
    geometry=st.sampled_from(Geometry),
    presence=st.integers(0, 255).map(lambda fraction: fraction / 255),
    curvature=halves,
    fresh=st.booleans(),
    friction=st.booleans(),
    ledger=ledgers,
)


def as_surface(scale: float, units: list[tuple[int, int, int]]) -> Surface:
    return Surface(scale, np.array(units, dtype=np.int16).reshape(-1, 3))


surfaces = st.builds(
    as_surface,
    floats(2.0**-126, 3e-4),
    st.lists(st.tuples(shorts, shorts, shorts), min_size=3, max_size=40),
)
scenes = st.builds(
    Scene,
    tick=counts,
    t_server=times,
    users=st.lists(user_records, max_size=4).map(tuple),
    surface=st.none() | surfaces,
    room=rooms,
)
