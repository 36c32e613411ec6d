"""The golden vectors, which the page's implementation reads too: bytes, and their meaning.

`python -m tests.shared.protocol.test_vectors` writes them again after a change of the protocol.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.company import CompanyNews
from cohaptic.protocol.messages import decode_server_control
from cohaptic.protocol.patch import (
    Patch,
)
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.watch_messages import (
    ClientMessage,
    Latency,
    Moderated,
    PutOut,
    Watching,
    decode_client_message,
    decode_watch_control,
)
from tests.shared.protocol.control import CONTROL
from tests.shared.protocol.vectors import (
    ACKS,
    OF_SCENE,
    PATCHES,
    REST_MESHES,
    SAMPLES,
    SCENES,
    as_json,
    binary_vectors,
    control_vectors,
    traversal_vectors,
)

FOLDER = Path(__file__).parents[2] / "vectors"


@pytest.mark.parametrize("kind", ["contact_sample", "patch", "ack"])
def test_the_written_frames_are_those_we_send(kind: str) -> None:
    written = json.loads((FOLDER / f"{kind}.json").read_text())
    # Through JSON, so that tuples and lists compare.
    assert written == json.loads(as_json(binary_vectors()[kind]))


@pytest.mark.parametrize("kind", ["contact_sample", "patch", "ack"])
def test_the_written_frames_are_understood(kind: str) -> None:
    for vector in json.loads((FOLDER / f"{kind}.json").read_text()):
        data = bytes.fromhex(vector["hex"])
        if kind == "patch":
            assert Patch.decode(data) == PATCHES[vector["name"]]
        elif kind == "ack":
            assert Ack.decode(data) == ACKS[vector["name"]]
        else:
            assert ContactSample.decode(data) == SAMPLES[vector["name"]]


def test_the_written_rest_mesh_is_understood_whatever_deflates_it() -> None:
    """Another library may deflate otherwise: the fields are compared, not the bytes."""
    written = json.loads((FOLDER / "rest_mesh.json").read_text())
    sent = json.loads(json.dumps(binary_vectors()["rest_mesh"]))
    for vector, mine in zip(written, sent, strict=True):
        assert vector["fields"] == mine["fields"]
        assert RestMesh.decode(bytes.fromhex(vector["hex"])) == REST_MESHES[vector["name"]]


def test_the_written_quantised_mesh_is_understood_whatever_deflates_it() -> None:
    written = json.loads((FOLDER / "quantised_mesh.json").read_text())
    sent = json.loads(json.dumps(binary_vectors()["quantised_mesh"]))
    for vector, mine in zip(written, sent, strict=True):
        assert vector["fields"] == mine["fields"]
        mesh = QuantisedMesh.decode(bytes.fromhex(vector["hex"]))
        assert mesh.places.tolist() == vector["fields"]["vertices"]
        assert mesh.faces.tolist() == vector["fields"]["faces"]
        assert mesh.low.tolist() == vector["fields"]["low"]
        assert mesh.unit.tolist() == vector["fields"]["unit"]


def test_the_written_scenes_are_understood_whatever_deflates_them() -> None:
    written = json.loads((FOLDER / "scene.json").read_text())
    sent = json.loads(json.dumps(binary_vectors()["scene"]))
    for vector, mine in zip(written, sent, strict=True):
        assert vector["fields"] == mine["fields"]
        assert Scene.decode(bytes.fromhex(vector["hex"]), OF_SCENE) == SCENES[vector["name"]]


def test_the_written_traversals_are_ours() -> None:
    written = json.loads((FOLDER / "traversal.json").read_text())
    assert written == json.loads(json.dumps(traversal_vectors()))


def test_the_written_control_messages_are_those_we_send_and_understand() -> None:
    written = json.loads((FOLDER / "control.json").read_text())
    assert written == control_vectors()
    for vector in written:
        mine = CONTROL[vector["name"]]
        assert decoder(mine)(vector["text"]) == mine


def decoder(message: object) -> Callable[[str], object]:
    """Who reads a message of this type."""
    if isinstance(message, ClientMessage):
        return decode_client_message
    to_watchers = Watching | Latency | Moderated | PutOut | CompanyNews
    return decode_watch_control if isinstance(message, to_watchers) else decode_server_control


if __name__ == "__main__":
    others = {"control": control_vectors(), "traversal": traversal_vectors()}
    for kind, vectors in {**binary_vectors(), **others}.items():
        (FOLDER / f"{kind}.json").write_text(as_json(vectors))
