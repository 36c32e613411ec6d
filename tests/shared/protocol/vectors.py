"""Messages of every kind, with their bytes and fields: the golden vectors of the protocol."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from cohaptic.control.friction import Compliance3
from cohaptic.control.hand_model import HandModel
from cohaptic.control.law import Law
from cohaptic.control.room_lag import RoomLag
from cohaptic.control.tick_ledger import TickLedger
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import (
    encode_control,
)
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.partners import Partner, Partners
from cohaptic.protocol.patch import (
    MAX_COUPLING,
    MAX_LAG,
    MAX_MARGIN,
    MIN_COMPLIANCE,
    Geometry,
    Patch,
)
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.scene_users import UserRecord
from cohaptic.protocol.traversal import Traversal
from cohaptic.vec import ZERO
from tests.shared.protocol.control import CONTROL
from tests.strategies import as_surface, single

SAMPLES = {
    "first": ContactSample(1, 0, 12345.5, (-0.125, 0.0, 0.25), (0.0, 0.0, 0.0)),
    "pressing": ContactSample(
        4_000_000_000,
        77,
        12345.625,
        (single(-0.0875), single(0.001), 0.0),
        (single(-3.2), single(0.01), 0.0),
    ),
    "holding": ContactSample(
        2, 77, 12345.75, (0.125, 0.0, 0.0), (1.5, 0.25, 0.0), (single(0.1), -0.0625, 0.0)
    ),
    "giving": ContactSample(
        3, 78, 12345.875, (0.125, 0.0, 0.0), (1.5, 0.25, 0.0), (0.125, -0.0625, 0.0), 0.00390625
    ),
    "simulated": ContactSample(
        4, 79, 12346.0, (0.125, 0.0, 0.0), (1.5, 0.25, 0.0), None, -0.001953125,
        HandModel(0.25, 8.0, 400.0),
    ),
}  # fmt: skip
CUT = TickLedger(-0.25, -0.5, 0.125, -1.5, -0.0625, 256.0)
HALF = RoomLag(single(0.35), 1.25, 1.5)  # coupling and margin have 16 bits
PATCHES = {
    # Nobody else: as far from the edge as can be said.
    "plane": Patch(
        tick=1, seq=0, t_server=500.25, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
        law=Law.PROPORTIONAL, x_free=(-0.125, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), curvature=0.0,
        c_ii=0.00390625, k_h=256.0, integral_gain=0.0, own_force=ZERO, u_others=ZERO,
        room=RoomLag(0.0, 0.0, MAX_MARGIN),
    ),
    "sphere": Patch(
        tick=4_000_000_000, seq=9, t_server=500.5, t_client=12345.625, sample_wait=single(0.003),
        geometry=Geometry.SPHERE, law=Law.PI,
        x_free=(0.0, single(0.1), single(-0.02)), normal=(0.0, 1.0, 0.0), curvature=10.0,
        c_ii=single(0.00368), k_h=single(140.8), integral_gain=single(8400.0),
        own_force=(single(0.25), single(2.75), single(-0.125)),
        u_others=(single(0.0011), single(-0.0042), single(0.0003)), room=HALF,
    ),
    "rough": Patch(
        tick=3, seq=2, t_server=501.0, t_client=12346.0, sample_wait=0.0, geometry=Geometry.PLANE,
        law=Law.PREDICTIVE, x_free=(-0.125, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), curvature=0.0,
        c_ii=0.00390625, k_h=256.0, integral_gain=0.0, own_force=(-0.5, 0.125, 0.0625),
        u_others=(0.0, 0.00390625, 0.0), room=HALF, ledger=CUT,
        compliance=Compliance3(0.00390625, 0.0078125, 0.015625, -0.0009765625, 0.0, 0.001953125),
    ),
    "mesh": Patch(
        tick=2, seq=1, t_server=500.75, t_client=12345.75, sample_wait=0.0, geometry=Geometry.MESH,
        law=Law.PREDICTIVE, x_free=(-0.125, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), curvature=8.0,
        c_ii=0.00390625, k_h=256.0, integral_gain=0.0, own_force=(-0.5, 0.0, 0.0),
        u_others=(0.001953125, 0.0, -0.001953125), room=RoomLag(0.125, 0.75, 1.3330078125),
        neighbourhood=Neighbourhood.of_units(
            scale=single(1e-6), c_scale=single(6e-8), indices=(0, 3, 65_534),
            displacements=((0, 0, 0), (-32_768, 1, 32_767), (2, -3, 4)),
            compliances=(65_535, 0, 32_000),
        ),
    ),
    # With everything that a patch may have, for a client that moves models of two others.
    "partners": Patch(
        tick=6, seq=5, t_server=502.0, t_client=12347.0, sample_wait=0.0, geometry=Geometry.MESH,
        law=Law.PREDICTIVE, x_free=(-0.125, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), curvature=8.0,
        c_ii=0.00390625, k_h=256.0, integral_gain=0.0, own_force=(-0.5, 0.125, 0.0625),
        u_others=(0.001953125, 0.0, -0.001953125), room=RoomLag(0.125, 0.75, 1.3330078125),
        neighbourhood=Neighbourhood.of_units(
            scale=single(1e-6), c_scale=single(6e-8), indices=(7,), displacements=((1, -2, 3),),
            compliances=(65_000,),
        ),
        compliance=Compliance3(0.00390625, 0.0078125, 0.015625, -0.0009765625, 0.0, 0.001953125),
        partners=Partners(
            0.75,
            8.0,
            HandModel(0.125, 8.0, 400.0),
            (
                Partner(
                    2, HandModel(0.25, 4.5, 800.0), 0.015625, 0.0078125, 2.5, 10.0, 0.0048828125,
                    (-0.001953125,),
                ),
                Partner(
                    4_000_000_000, HandModel(0.5, 2.0, 150.0), -0.25, 0.0, 0.0, 5.0, 0.0078125,
                    (0.0009765625, 0.0),
                ),
            ),
        ),
    ),
    # What is held or hard, on a device that is the softer; numbers at their limits.
    "held": Patch(
        tick=5, seq=4, t_server=501.5, t_client=12346.5, sample_wait=0.0, geometry=Geometry.PLANE,
        law=Law.PREDICTIVE, x_free=(0.0, 0.0, -0.125), normal=(0.0, 0.0, -1.0), curvature=-1e4,
        c_ii=single(MIN_COMPLIANCE), k_h=800.0, integral_gain=1e9, own_force=(0.0, 0.0, -3.5),
        u_others=ZERO, room=RoomLag(MAX_LAG, MAX_COUPLING, 0.0),
    ),
}  # fmt: skip
REST_MESHES = {
    "tetrahedron": RestMesh(
        ((0.125, 0.0, 0.0), (-0.125, 0.0, 0.0), (0.0, 0.25, 0.0), (0.0, 0.0, 0.5)),
        ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    ),
}
QUANTISED_MESHES = {
    name: QuantisedMesh.of(np.array(vertices), np.array(faces))
    for name, vertices, faces in [
        ("tetrahedron", REST_MESHES["tetrahedron"].vertices, REST_MESHES["tetrahedron"].faces),
        # Flat along x; the last vertex is on no face, and an edge has three of them.
        (
            "fan",
            [
                *[(2.0, 0.0, 0.0), (2.0, 1.0, 0.0), (2.0, 0.3, 0.7), (2.0, 0.4, -9.0)],
                *[(2.0, 0.5, 0.1), (2.0, -1.0, 3.0)],
            ],
            [(0, 1, 2), (1, 0, 3), (0, 1, 4)],
        ),
    ]
}
ACKS = {"drawn": Ack(1), "columns missing": Ack(4_000_000_000, wants=1)}
ANN = UserRecord(
    user=1, probe=(-0.125, 0.0, 0.25), foot=(-0.125, 0.0, 0.1875), force=(-2.5, 0.25, 0.0),
    c_ii=0.00390625, k_o_coupled=160.0, k_h=256.0, integral_gain=0.0, loop_delay=0.0625,
    normal=(-1.0, 0.0, 0.0), law=Law.PREDICTIVE, geometry=Geometry.MESH, presence=1.0,
    curvature=10.0, fresh=True, friction=True, x_free=(-0.125, 0.0078125, 0.0), ledger=CUT,
)  # fmt: skip
BOB = UserRecord(  # has left: without law, its force fades
    user=4_000_000_000, probe=(0.0, single(0.1), single(-0.02)), foot=(0.0, single(0.1), 0.0),
    force=(0.0, single(0.7), 0.0), c_ii=0.0, k_o_coupled=0.0, k_h=0.0, integral_gain=0.0,
    loop_delay=0.0, normal=(0.0, 26214 / 32767, -19660 / 32767), law=Law.PROPORTIONAL,
    geometry=Geometry.PLANE, presence=51 / 255, curvature=0.0, fresh=False, friction=False,
    x_free=(0.0, single(0.1), single(-0.02) + 0.015625),
)  # fmt: skip
SCENES = {
    "nobody": Scene(1, 500.25, (), room=RoomLag(0.0, 0.0, MAX_MARGIN)),
    "forces": Scene(77, 500.5, (ANN, BOB), room=HALF),
    "surface": Scene(
        4_000_000_000,
        500.75,
        (ANN,),
        # Steps that wrap, of both signs, beside small ones.
        as_surface(
            single(1e-5),
            [
                (0, 1, -1), (-32768, 2, -3), (32767, 300, -300), (32767, 0, 7), (5, -4, 3),
                (-20000, 20000, 11),
            ],
        ),
        RoomLag(0.125, 0.75, 1.3330078125),
    ),
}  # fmt: skip
Faces = list[tuple[int, int, int]]
OCTAHEDRON: Faces = [
    (0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1), (5, 2, 1), (5, 3, 2), (5, 4, 3), (5, 1, 4),
]  # fmt: skip
MESHES: dict[str, tuple[int, Faces]] = {
    "octahedron": (6, OCTAHEDRON),  # of the scene with a surface
    "strip and a triangle apart": (8, [(0, 4, 2), (2, 4, 6), (4, 1, 6), (3, 5, 7)]),
    "three faces at one edge": (5, [(0, 1, 2), (1, 0, 3), (0, 1, 4)]),
}
TRAVERSALS = {name: Traversal.of(n, faces) for name, (n, faces) in MESHES.items()}
OF_SCENE = TRAVERSALS["octahedron"]


def binary_vectors() -> dict[str, list[dict[str, Any]]]:
    """Every binary vector: name, frame in hexadecimal, fields."""
    return {
        "contact_sample": [
            {
                "name": n,
                "hex": m.encode().hex(),
                "fields": m._asdict() | {"own_model": m.own_model and m.own_model._asdict()},
            }
            for n, m in SAMPLES.items()
        ],
        "patch": [
            {
                "name": n,
                "hex": m.encode().hex(),
                "fields": asdict(m)
                | {"geometry": m.geometry.name.lower(), "law": m.law.value}
                | {
                    "room": asdict(m.room),
                    "ledger": asdict(m.ledger),
                    "neighbourhood": neighbourhood_fields(m.neighbourhood),
                    "partners": partners_fields(m.partners),
                },
            }
            for n, m in PATCHES.items()
        ],
        "rest_mesh": [
            {"name": n, "hex": m.encode().hex(), "fields": asdict(m)}
            for n, m in REST_MESHES.items()
        ],
        "quantised_mesh": [
            {
                "name": n,
                "hex": m.encode().hex(),
                "fields": {
                    "low": m.low.tolist(),
                    "unit": m.unit.tolist(),
                    "vertices": m.places.tolist(),
                    "faces": m.faces.tolist(),
                },
            }
            for n, m in QUANTISED_MESHES.items()
        ],
        "ack": [{"name": n, "hex": m.encode().hex(), "fields": asdict(m)} for n, m in ACKS.items()],
        "scene": [
            {"name": n, "hex": m.encode(OF_SCENE).hex(), "fields": scene_fields(m)}
            for n, m in SCENES.items()
        ],
    }


def traversal_vectors() -> list[dict[str, Any]]:
    """Every mesh with its traversal."""
    return [
        {"name": name, "vertices": MESHES[name][0], "faces": MESHES[name][1]}
        | {key: getattr(t, key).tolist() for key in ("order", "p", "q", "r")}
        for name, t in TRAVERSALS.items()
    ]


def scene_fields(scene: Scene) -> dict[str, Any]:
    """Fields of a scene; `surface` has its scale and its units, vertex by vertex."""
    surface = scene.surface
    return {
        "tick": scene.tick,
        "t_server": scene.t_server,
        "users": [
            asdict(user) | {"law": user.law.value, "geometry": user.geometry.name.lower()}
            for user in scene.users
        ],
        "surface": surface and {"scale": surface.scale, "units": surface.units.tolist()},
        "room": asdict(scene.room),
    }


def as_json(vectors: list[dict[str, Any]]) -> str:
    """Content of a file; a law is given by its name."""
    return json.dumps(vectors, indent=1) + "\n"


def control_vectors() -> list[dict[str, Any]]:
    """Every control message: name, text."""
    return [{"name": n, "text": encode_control(m)} for n, m in CONTROL.items()]


def neighbourhood_fields(near: Neighbourhood | None) -> dict[str, Any] | None:
    """A neighbourhood as numbers, as the page has it."""
    if near is None:
        return None
    names = ("scale", "c_scale", "indices", "displacements", "compliances")
    return {name: getattr(near, name) for name in names}


def partners_fields(others: Partners | None) -> dict[str, Any] | None:
    """The other hands of a patch, every number by its name."""
    if others is None:
        return None
    return {
        "weight": others.weight,
        "max_force": others.max_force,
        "model": others.model._asdict(),
        "partners": [p._asdict() | {"model": p.model._asdict()} for p in others.partners],
    }
