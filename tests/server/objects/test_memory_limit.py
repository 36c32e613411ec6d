"""A file whose counts lie costs an error, and not the memory that it asks for."""

from __future__ import annotations

import logging
import struct
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.memory_limit import reading_limited, silenced
from cohaptic_server.objects.surface.surface_file import read_surface
from cohaptic_server.objects.volume_file import read_volume

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits a process")


def test_a_volume_mesh_with_a_lying_count_is_refused_for_its_memory(tmp_path: Path) -> None:
    """That of Fluent, which meshio reads."""
    path = tmp_path / "lies.msh"
    path.write_bytes(b"(2 3)\n(12 (0 1 20000000 0))\n(12 (1 1 20000000 1 2)(\n1 2 3 4\n))\n")
    with pytest.raises(BodyError, match=r"would take more than 1.1 GB; the file has \d\d bytes"):
        read_volume(path)


@pytest.mark.parametrize("claimed", [2**29, 2**60])
def test_a_reader_of_our_own_takes_no_memory_for_a_lying_count(
    tmp_path: Path, claimed: int
) -> None:
    path = tmp_path / "lies.msh"
    head = b"$MeshFormat\n4.1 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n$Nodes\n"
    nodes = struct.pack("<4Q", 1, claimed, 1, claimed) + struct.pack("<3iQ", 3, 1, 0, claimed)
    path.write_bytes(head + nodes + bytes(400) + b"\n$EndNodes\n")
    with pytest.raises(BodyError, match="no mesh that can be read"):
        read_volume(path)


@pytest.mark.parametrize("form", ["ASCII", "BINARY"])
def test_a_grid_of_vtk_takes_no_memory_for_a_lying_count(tmp_path: Path, form: str) -> None:
    path = tmp_path / "lies.vtk"
    head = f"# vtk DataFile Version 4.2\nlies\n{form}\nDATASET UNSTRUCTURED_GRID\n"
    path.write_bytes(f"{head}POINTS {2**59} double\n".encode() + b"0 0 0 " * 40)
    with pytest.raises(BodyError, match=r"it ends after \d+ of 1,729,"):
        read_volume(path)


def test_a_surface_with_a_lying_count_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "lies.ply"
    path.write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n"
        b"property float y\nproperty float z\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n" + bytes(50)
    )
    with pytest.raises(BodyError, match="no mesh that can be read"):
        read_surface(path)


def test_numbers_beyond_their_type_are_no_warnings(tmp_path: Path) -> None:
    """The checks behind a reader say in words what a damaged number means."""
    (tmp_path / "small").write_bytes(b"1")
    with reading_limited(tmp_path / "small"):
        assert np.array([np.nan, 1e38]).astype(np.int64).max() < 0
    with pytest.warns(RuntimeWarning, match="invalid value"):
        np.array([np.nan]).astype(np.int64)


def test_a_library_says_nothing_by_any_way_and_speaks_again_afterwards(
    capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    """Its modules have loggers of their own, some of which were made before."""
    inner = logging.getLogger("some_library.part.of_it")

    def library() -> None:
        inner.error("a traceback")
        logging.getLogger("some_library").critical("a traceback")
        warnings.warn("odd", stacklevel=1)
        print("progress")
        print("trouble", file=sys.stderr)
        raise ValueError("an end")

    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        with pytest.raises(ValueError, match="an end"), silenced("some_library"):
            library()
    assert (capfd.readouterr(), caplog.text, heard) == (("", ""), "", [])
    inner.error("it speaks")
    assert "it speaks" in caplog.text


def test_the_limit_ends_with_the_block(tmp_path: Path) -> None:
    import resource

    path = tmp_path / "small"
    path.write_bytes(b"1")
    before = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.raises(BodyError, match="would take more than"), reading_limited(path):
        np.zeros(2**31, dtype=np.uint8)
    assert resource.getrlimit(resource.RLIMIT_AS) == before
    assert len(np.zeros(2**31, dtype=np.uint8)) == 2**31


def test_a_lower_limit_stays(tmp_path: Path) -> None:
    import resource

    path = tmp_path / "small"
    path.write_bytes(b"1")
    before = resource.getrlimit(resource.RLIMIT_AS)
    lower = 2**30
    with reading_limited(path):
        inner = resource.getrlimit(resource.RLIMIT_AS)[0]
        resource.setrlimit(resource.RLIMIT_AS, (lower, before[1]))
        with reading_limited(path):
            assert resource.getrlimit(resource.RLIMIT_AS)[0] == lower
    assert inner > lower
    assert resource.getrlimit(resource.RLIMIT_AS) == before
