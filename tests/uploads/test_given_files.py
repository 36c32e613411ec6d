"""Files as people have them: read, or refused with their cause, by `inspect` and by an upload.

Each file in `given/` once ended in a traceback, in another object without a word, or in a refusal
for the wrong reason.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from cohaptic.errors import CohapticError
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.upload_messages import Examined
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_tools.body_cli import body
from cohaptic_uploads.described import from_fields
from cohaptic_uploads.limits import UploadLimits
from cohaptic_uploads.pipe import DATA, fields_of
from cohaptic_uploads.process import UploadFailed, WorkerProcess

pytestmark = pytest.mark.live
pytest.importorskip("nibabel", reason="pip install 'cohaptic[scans]' reads scans")

GIVEN = Path(__file__).parent / "given"
HOLD = ("--fix", "x < 30%", "--order", "1", "--edge", "0.15")


@dataclass(frozen=True, slots=True)
class Read:
    """A file that is read.

    Args:
        volume: Volume of the object [cm3].
        parts: Names of its parts.
        said: Words of the log on how it is read otherwise than it is written.
    """

    volume: float
    parts: tuple[str, ...] = ()
    said: str = ""


TURNED = "tetrahedra are inside out and are turned"
MERGED = "points lie at the place of another one"
COLLAPSED = "vertices lie at one place, so that each triangle has collapsed"
READ = {
    "a41.msh": Read(500.0, ("liver",)),
    "ascii_cr.stl": Read(1000.0),
    "comma.obj": Read(1000.0),
    "comma6.stl": Read(1000.0),
    "count0.stl": Read(1000.0, said="its header counts 0 triangles; the 12 that it has are read"),
    "dg.vtu": Read(512.0, said=MERGED),
    "far_12.vtu": Read(216.0, said=TURNED),
    "far_9.95.vtu": Read(216.0, said=TURNED),
    "instanced.glb": Read(1500.0, ("node", "node.2")),
    "inverted1.vtu": Read(512.0, said=TURNED),
    "ok.vtu": Read(216.0, said=TURNED),
    "overlapping_groups.msh": Read(500.0, ("1",), "1 tetrahedra are there more than once"),
    "quant_norm.glb": Read(1000.0),
    "slit.vtu": Read(512.0, said=MERGED),
    "sparse.glb": Read(1000.0),
    "tail2.stl": Read(1000.0),
    "two.vtu": Read(432.0, said=MERGED),
}
REFUSED = {
    "draco_half.glb": r"compressed by Draco \(KHR_draco_mesh_compression\), which is not read here",
    "ext_meshopt.glb": r"compressed by meshopt \(EXT_meshopt_compression\), which is not read here",
    "hinge.vtu": r"hang together by edges or corners only.*one is at \(0.06, 0.06, 0\)",
    "mismatch.vtu": r"hang together by edges or corners only.*one is at \(0.03, 0, 0\)",
    "point.stl": COLLAPSED,
    "zeros.glb": COLLAPSED,
    "zeros.stl": COLLAPSED,
}


def inspected(path: Path) -> str:
    """The words of `cohaptic body inspect`; raises its error."""
    said = CliRunner().invoke(body, ["inspect", str(path), *HOLD], env={"COLUMNS": "300"})
    if said.exception is not None and not isinstance(said.exception, SystemExit):
        raise said.exception
    return said.output


@contextmanager
def brought(path: Path) -> Generator[tuple[WorkerProcess, Examined, RestMesh]]:
    """A file that was brought to the page: its worker, what it found, and the preview.

    Raises:
        UploadFailed: The worker refuses the file, with its sentence.
    """
    worker = WorkerProcess(UploadLimits(), path.name.encode("utf-8", "replace").decode())
    try:
        worker.send_piece(path.read_bytes())
        worker.send_piece(b"")
        kind, reported = worker.receive()
        assert kind != DATA
        if "message" not in (fields := fields_of(reported)):
            raise UploadFailed(str(fields["why"]))
        preview = RestMesh.decode(worker.receive()[1])
        yield worker, Examined.model_validate_json(str(fields["message"])), preview
    finally:
        worker.close()


def only_brought(path: Path) -> None:
    """Bring a file to the page, and see what is found in it."""
    with brought(path):
        pass


def prepared(worker: WorkerProcess) -> ObjectFile:
    """The object that the worker has prepared; raises UploadFailed with its sentence."""
    worker.send_wish(fix=HOLD[1], young=6e3, poisson=0.4)
    while (reported := fields_of(worker.receive()[1]))["event"] == "progress":
        pass
    if reported["event"] != "prepared":
        raise UploadFailed(str(reported["why"]))
    return from_fields(reported["source"])


@pytest.mark.parametrize("way", [inspected, only_brought])
@pytest.mark.parametrize("name", sorted(REFUSED))
def test_what_is_no_object_is_refused_with_its_cause(
    name: str, way: Callable[[Path], object]
) -> None:
    with pytest.raises(CohapticError, match=REFUSED[name]) as refused:
        way(GIVEN / name)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", sorted(READ))
def test_an_upload_shows_the_same_object_and_prepares_it(name: str) -> None:
    with brought(GIVEN / name) as (worker, examined, preview):
        shown = np.array(preview.vertices)
        whole = build(ObjectFile.of(GIVEN / name, {"fix": HOLD[1], "order": 1, "edge": 0.15}))
        # About its middle, which is told in the frame of the file.
        assert shown.min(axis=0) == pytest.approx(-shown.max(axis=0), abs=1e-6)
        origin = whole.solid.mesh.origin
        assert examined.middle == pytest.approx(origin, abs=0.006)
        assert np.ptp(shown, axis=0) == pytest.approx(
            np.ptp(whole.solid.mesh.vertices, axis=0), rel=0.02
        )
        if name.endswith((".vtu", ".msh")):  # filling a surface takes ten seconds
            tets = build(prepared(worker)).solid.shape.tets
            assert 1e6 * tets.volume == pytest.approx(READ[name].volume)


@pytest.mark.parametrize("name", [b"Sch\344del.vtu", b"a\nb\033[31mred.vtu"])
def test_a_name_may_hold_anything(name: bytes, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="pip install 'cohaptic[objects]'")
    path = tmp_path / name.decode("utf-8", "surrogateescape")
    try:
        shutil.copy(GIVEN / "ok.vtu", path)
    except OSError:
        pytest.skip("this file system takes no such name")
    options = [str(path), *HOLD, "--out", str(path.with_suffix(".png"))]
    said = CliRunner().invoke(body, ["inspect", *options], env={"COLUMNS": "300"})
    assert said.exit_code == 0, said.output
    assert all(c.isprintable() or c == "\n" for c in said.output)
    shown = build(ObjectFile.of(path, {"fix": HOLD[1], "order": 1})).solid.name
    assert shown.isprintable()
    assert shown.encode()
    with brought(path) as (worker, _, _):
        assert build(prepared(worker)).solid.shape.tets.volume == pytest.approx(216e-6)
