"""Whatever is in a file, examining it ends in what was found or in one sentence for people."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cohaptic.errors import CohapticError
from cohaptic_server.touchable import KINDS
from cohaptic_uploads.examine import examine
from tests.uploads.sound import SOUND, volume

pytest.importorskip("nibabel", reason="pip install 'cohaptic[scans]' reads scans")
pytest.importorskip("nrrd", reason="pip install 'cohaptic[scans]' reads scans")

# Of a file of each kind; and what is a beginning of some kind, or of none.
_CUTS = (0.0, 0.02, 0.1, 0.3, 0.6, 0.95)
_RUBBISH = (
    b"(", b'(1 "m', b"\0" * 60, b"\xff" * 600, b" ", b"\n", b"{}", b"[]", b"solid\n", b"OFF\n",
    b"ply\n", b"$MeshFormat\n", b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n", b"<VTKFile/>",
    b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n", b"NRRD0004\n\n",
    b"PK\x05\x06" + b"\0" * 18, b"\x1f\x8b", b"v 0 0\nf 1 2 3\n", b"f 1 2\n",
)  # fmt: skip


def said_of(path: Path, content: bytes) -> str:
    """The sentence about a file; empty where there is something in it."""
    path.write_bytes(content)
    try:
        examine(path, 1000)
    except CohapticError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("kind", KINDS)
def test_a_broken_file_is_refused_with_its_reason(kind: str, tmp_path: Path) -> None:
    whole = SOUND[kind]()
    path = tmp_path / f"object{kind}"
    assert said_of(path, whole) == ""
    for content in (*(whole[: int(cut * len(whole))] for cut in _CUTS), *_RUBBISH):
        said = said_of(path, content).removeprefix(f"{path}: ")
        assert "\n" not in said
        # No name of an exception, and no text that is empty.
        assert not re.search(r"\w(Error|Iteration|Exception)\b|\( ?\)|:$", said), (content, said)


@pytest.mark.parametrize("cut", range(1, 100, 3))
def test_a_mesh_of_fluent_that_is_cut_off_ends(cut: int, tmp_path: Path) -> None:
    whole = volume(".msh", "ansys")
    assert said_of(tmp_path / "whole.msh", whole) == ""
    assert said_of(tmp_path / "a.msh", whole[: cut * len(whole) // 100])
