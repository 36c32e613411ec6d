"""The golden vectors that a second language reads too: bytes, and what they mean.

`python -m tests.shared.protocol.test_vectors` writes them again after a change of the protocol.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from cohaptic.control.friction import Compliance3
from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control import (
    Bye,
    Error,
    Hello,
    SetLaw,
    UserJoined,
    UserLeft,
    Welcome,
    decode_client_control,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.version import PROTOCOL_VERSION
from tests.strategies import single

FOLDER = Path(__file__).parents[2] / "vectors"

SAMPLES = {
    "first": ContactSample(1, 0, 12345.5, (-0.125, 0.0, 0.25), (0.0, 0.0, 0.0)),
    "pressing": ContactSample(
        4_000_000_000,
        77,
        12345.625,
        (single(-0.0875), single(0.001), 0.0),
        (single(-3.2), single(0.01), 0.0),
    ),
}
PATCHES = {
    "plane": Patch(
        tick=1, seq=0, t_server=500.25, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
        law=Law.PROPORTIONAL,
        x_free=(-0.125, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), curvature=0.0, k_o=256.0,
        k_o_coupled=160.0, c_ii=0.00390625, k_h=256.0, integral_gain=0.0, own_force=0.0,
        u_others=0.0,
    ),
    "sphere": Patch(
        tick=4_000_000_000, seq=9, t_server=500.5, t_client=12345.625, sample_wait=single(0.003),
        geometry=Geometry.SPHERE,
        law=Law.PI, x_free=(0.0, single(0.1), single(-0.02)), normal=(0.0, 1.0, 0.0),
        curvature=10.0, k_o=single(271.5), k_o_coupled=single(148.25), c_ii=single(0.00368),
        k_h=single(140.8), integral_gain=single(8400.0), own_force=single(2.75),
        u_others=single(-0.0042),
    ),
    "rough": Patch(
        tick=3, seq=2, t_server=501.0, t_client=12346.0, sample_wait=0.0, geometry=Geometry.PLANE,
        law=Law.PREDICTIVE, x_free=(-0.125, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), curvature=0.0,
        k_o=256.0, k_o_coupled=160.0, c_ii=0.00390625, k_h=256.0, integral_gain=0.0, own_force=0.5,
        u_others=0.0,
        compliance=Compliance3(0.00390625, 0.0078125, 0.015625, -0.0009765625, 0.0, 0.001953125),
    ),
    "mesh": Patch(
        tick=2, seq=1, t_server=500.75, t_client=12345.75, sample_wait=0.0, geometry=Geometry.MESH,
        law=Law.PREDICTIVE, x_free=(-0.125, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), curvature=8.0,
        k_o=256.0, k_o_coupled=160.0, c_ii=0.00390625, k_h=256.0, integral_gain=0.0, own_force=0.5,
        u_others=0.0,
        neighbourhood=Neighbourhood(
            scale=single(1e-6), c_scale=single(6e-8), indices=(0, 3, 65_534),
            displacements=((0, 0, 0), (-32_768, 1, 32_767), (2, -3, 4)),
            compliances=(65_535, 0, 32_000),
        ),
    ),
}  # fmt: skip
REST_MESHES = {
    "tetrahedron": RestMesh(
        ((0.125, 0.0, 0.0), (-0.125, 0.0, 0.0), (0.0, 0.25, 0.0), (0.0, 0.0, 0.5)),
        ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    ),
}
CONTROL: dict[str, Any] = {
    "hello": Hello(protocol=PROTOCOL_VERSION, name="left"),
    "set_law": SetLaw(law=Law.PI),
    "bye": Bye(),
    "welcome": Welcome.model_validate(
        {
            "user": 2,
            "name": "right",
            "simulation_period": 0.0625,
            "to_wall": 1.75e9,
            "body": {
                "name": "balloon",
                "center": (0.0, 0.0, 0.0),
                "radius": 0.1,
                "contact_radius": 0.02,
            },
            "users": ("left",),
        }
    ),
    "user_joined": UserJoined(user=2, name="right"),
    "user_left": UserLeft(user=2, name="right", reason="bye"),
    "error": Error(code=4409, message="name is 'left'; expected one that is free (taken: left)"),
}


def binary_vectors() -> dict[str, list[dict[str, Any]]]:
    """Every binary vector: name, frame in hexadecimal, fields."""
    return {
        "contact_sample": [
            {"name": n, "hex": m.encode().hex(), "fields": asdict(m)} for n, m in SAMPLES.items()
        ],
        "patch": [
            {
                "name": n,
                "hex": m.encode().hex(),
                "fields": asdict(m) | {"geometry": m.geometry.name.lower(), "law": m.law.value},
            }
            for n, m in PATCHES.items()
        ],
        "rest_mesh": [
            {"name": n, "hex": m.encode().hex(), "fields": asdict(m)}
            for n, m in REST_MESHES.items()
        ],
    }


def as_json(vectors: list[dict[str, Any]]) -> str:
    """What a file holds; a law is its name."""
    return json.dumps(vectors, indent=1) + "\n"


def control_vectors() -> list[dict[str, Any]]:
    """Every control message: name, text."""
    return [{"name": n, "text": encode_control(m)} for n, m in CONTROL.items()]


@pytest.mark.parametrize("kind", ["contact_sample", "patch"])
def test_the_written_frames_are_what_we_send(kind: str) -> None:
    written = json.loads((FOLDER / f"{kind}.json").read_text())
    # Through JSON, so that tuples and lists compare.
    assert written == json.loads(as_json(binary_vectors()[kind]))


@pytest.mark.parametrize("kind", ["contact_sample", "patch"])
def test_the_written_frames_are_understood(kind: str) -> None:
    for vector in json.loads((FOLDER / f"{kind}.json").read_text()):
        data = bytes.fromhex(vector["hex"])
        if kind == "patch":
            assert Patch.decode(data) == PATCHES[vector["name"]]
        else:
            assert ContactSample.decode(data) == SAMPLES[vector["name"]]


def test_the_written_rest_mesh_is_understood_whatever_deflates_it() -> None:
    """Another library may deflate otherwise: the fields are compared, not the bytes."""
    written = json.loads((FOLDER / "rest_mesh.json").read_text())
    sent = json.loads(json.dumps(binary_vectors()["rest_mesh"]))
    for vector, mine in zip(written, sent, strict=True):
        assert vector["fields"] == mine["fields"]
        assert RestMesh.decode(bytes.fromhex(vector["hex"])) == REST_MESHES[vector["name"]]


def test_the_written_control_messages_are_what_we_send_and_understand() -> None:
    written = json.loads((FOLDER / "control.json").read_text())
    assert written == control_vectors()
    for vector in written:
        mine = CONTROL[vector["name"]]
        decode = (
            decode_client_control
            if isinstance(mine, Hello | SetLaw | Bye)
            else decode_server_control
        )
        assert decode(vector["text"]) == mine


if __name__ == "__main__":
    for kind, vectors in {**binary_vectors(), "control": control_vectors()}.items():
        (FOLDER / f"{kind}.json").write_text(as_json(vectors))
