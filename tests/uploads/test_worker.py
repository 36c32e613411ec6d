"""The worker against hostile files and hostile words: one sentence each, within its limits."""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import trimesh

from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.upload_messages import Examined
from cohaptic_server.testing.blocks import block
from cohaptic_uploads.described import from_fields
from cohaptic_uploads.kept_files import uploads_folder
from cohaptic_uploads.limits import UploadLimits
from cohaptic_uploads.pipe import DATA, fields_of
from cohaptic_uploads.process import UploadFailed, WorkerProcess
from tests.uploads.hostile import HOSTILE

pytestmark = pytest.mark.live

LIMITS = UploadLimits()
SMALL = UploadLimits(memory=5 * 10**8, examine=20.0, prepare=20.0)
# Those that take long are in `benchmarks/hostile_uploads.py`.
QUICK = (
    "lying-bomb.3mf",
    "billion.3mf",
    "lying.glb",
    "sparse.glb",
    "lying.msh",
    "five-million.ply",
)


def cube(size: float = 0.1) -> bytes:
    whole = io.BytesIO()
    box = trimesh.creation.box((size, size, size))  # pyright: ignore[reportUnknownMemberType]
    box.export(whole, file_type="stl")  # pyright: ignore[reportUnknownMemberType]
    return whole.getvalue()


def block_vtu(cells: int = 3) -> bytes:
    """A block of few tetrahedra, which needs no filling: it is prepared in a second."""
    tets = block((0.1, 0.1, 0.1), (cells, cells, cells))
    whole: Any = meshio.Mesh(tets.vertices, [("tetra", tets.tets)])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "block.vtu"
        whole.write(path)
        return path.read_bytes()


def brought(name: str, content: bytes, limits: UploadLimits = LIMITS) -> WorkerProcess:
    """A worker that has a file."""
    worker = WorkerProcess(limits, name)
    for at in range(0, len(content), 2**15):
        worker.send_piece(content[at : at + 2**15])
    worker.send_piece(b"")
    return worker


def why(worker: WorkerProcess) -> str:
    """Its one sentence."""
    try:
        kind, data = worker.receive()
        assert kind != DATA
        return str(fields_of(data)["why"])
    except UploadFailed as failed:
        return str(failed)
    finally:
        worker.close()


@pytest.mark.parametrize("name", QUICK)
def test_a_hostile_file_is_one_sentence_within_the_memory(name: str) -> None:
    said = why(brought(name, HOSTILE[name]()))
    assert "\n" not in said
    assert "Traceback" not in said
    assert any(word in said for word in ("limit", "more than", "can be read"))
    if sys.platform != "win32":
        import resource

        # Of all processes that a test of this session has waited for.
        unit = 1 if sys.platform == "darwin" else 1024
        assert unit * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < LIMITS.memory


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits a process")
def test_a_file_that_needs_more_memory_than_there_is_ends_its_worker_alone() -> None:
    points = np.random.default_rng(0).random((300_000, 3)).astype("<f4")
    rows = np.random.default_rng(0).integers(0, 300_000, (300_000, 3)).astype("<i4")
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 300000\nproperty float x\nproperty"
        " float y\nproperty float z\nelement face 300000\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )
    faces = np.zeros(300_000, dtype=[("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, rows
    said = why(brought("crowd.ply", head.encode() + points.tobytes() + faces.tobytes(), SMALL))
    assert "more memory than an upload may have" in said


def test_a_sound_file_is_examined_and_prepared_as_it_was_wished() -> None:
    worker = brought("a cube/../of mine.vtu", block_vtu())
    try:
        examined = Examined.model_validate_json(str(fields_of(worker.receive()[1])["message"]))
        kind, surface = worker.receive()
        assert examined.triangles == 108
        assert kind == DATA
        assert len(RestMesh.decode(surface).faces) == 108
        worker.send_wish(fix="z > 90%", young=6e3, poisson=0.3)
        phases: list[str] = []
        while (fields := fields_of(worker.receive()[1]))["event"] == "progress":
            phases.append(fields["phase"])
        source = from_fields(fields["source"])
        assert {"tetrahedra", "factoring"} <= set(phases)
        assert (source.fix, source.material.young, source.material.nu) == ("z > 90%", 6e3, 0.3)
        assert source.path.read_bytes() == block_vtu()
        assert source.path.name.startswith("of-mine-")
    finally:
        worker.close()


def report(worker: WorkerProcess) -> dict[str, Any]:
    """What it says of a wish, behind its progress."""
    while (fields := fields_of(worker.receive()[1]))["event"] == "progress":
        pass
    return fields


@pytest.mark.parametrize("rule", ["z < 1e999%", "w > 3", "z < 200%", "z < -1%", "(" * 10_000])
def test_a_rule_that_holds_nothing_or_all_is_one_sentence_and_another_may_follow(rule: str) -> None:
    worker = brought("block.vtu", block_vtu())
    try:
        worker.receive()
        worker.receive()
        worker.send_wish(fix=rule, young=6e3, poisson=0.3)
        fields = report(worker)
        assert (fields["event"], fields["about"]) == ("refused", "held")
        assert "\n" not in fields["why"]
        assert "--fix" not in fields["why"]
        worker.send_wish(fix="z < 15%", young=6e3, poisson=0.3)
        assert report(worker)["event"] == "prepared"
    finally:
        worker.close()
    # What was refused is not kept.
    assert len(list(uploads_folder().iterdir())) == 1


@pytest.mark.parametrize("scale", [1e-9, 0.049, 51.0, 1e9])
def test_a_size_that_cannot_be_touched_is_refused_and_another_is_taken(scale: float) -> None:
    worker = brought("block.vtu", block_vtu())
    try:
        examined = Examined.model_validate_json(str(fields_of(worker.receive()[1])["message"]))
        assert examined.scale == 1.0
        worker.receive()
        worker.send_wish(fix="z < 15%", young=6e3, poisson=0.3, scale=scale)
        fields = report(worker)
        assert (fields["event"], fields["about"]) == ("refused", "size")
        assert "it must be from 5 mm to 5 m" in fields["why"]
        worker.send_wish(fix="z < 15%", young=6e3, poisson=0.3, scale=0.5)
        source = from_fields(report(worker)["source"])
        assert source.scale == 0.5
    finally:
        worker.close()


@pytest.mark.skipif(sys.platform != "linux", reason="environments of processes are Linux's")
def test_a_worker_knows_no_storage_of_other_machines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_SHARED_CACHE", "s3://objects")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
    worker = WorkerProcess(LIMITS, "cube.stl")
    try:
        worker.send_piece(cube())
        worker.send_piece(b"")
        worker.receive()  # it runs: a process that is just starting has no environment yet
        environ = Path(f"/proc/{worker.pid}/environ").read_bytes()
        assert b"PATH=" in environ
        assert b"COHAPTIC_SHARED_CACHE" not in environ
        assert b"secret" not in environ
    finally:
        worker.kill()
        worker.close()
