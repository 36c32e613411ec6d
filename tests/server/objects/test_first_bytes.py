"""A file that is something else than its name says is told as what it is."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import struct
import zipfile
from pathlib import Path

import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.prepare import check_file
from cohaptic_server.touchable import KINDS, SCANS


def _zip() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.stl", b"solid a\nendsolid a\n" * 100)
    return file.getvalue()


_LINE = b"a part".ljust(72)
# What a file is, the words for it, and kinds of files that are it by right.
OTHERS: tuple[tuple[bytes, str, tuple[str, ...]], ...] = (
    (b"", "the file is empty", ()),
    (b"  \n", "the file is empty", ()),
    (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull", ()),
    (b"/annex/objects/SHA256E-s126--2c.stl\n", "git annex get", ()),
    (b"../../.git/annex/objects/x/Y/SHA256E-s126--2c.stl/SHA256E-s126--2c.stl", "annex get", ()),
    (b"<!DOCTYPE html><html></html>", "it is a web page", ()),
    (b'\xef\xbb\xbf<?xml version="1.0"?>\n<!-- a page -->\n<HTML lang="en">', "a web page", ()),
    (b'<?xml version="1.0"?>\n<Error><Code>NoSuchKey</Code></Error>', "error message", ()),
    (b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('a part'),'2;1');\n" * 20, "a STEP file", ()),
    (_LINE + b"S      1\n" + _LINE + b"G      1\n", "an IGES file", ()),
    (_LINE + b"S0000001\n" + _LINE + b"G0000001\n", "an IGES file", ()),
    (b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7400) + bytes(100), "an FBX file", ()),
    (b"; FBX 7.7.0 project file\n; -----\nFBXHeaderExtension:  {\n", "an FBX file", ()),
    (b"BLENDER-v306REND" + bytes(200), "a scene of Blender", ()),
    (b"BLENDER17-01v0500" + bytes(200), "a scene of Blender", ()),
    (b'<?xml version="1.0"?>\n<COLLADA xmlns="x">', "a Collada file", ()),
    (b"PXR-USDC" + bytes(80), "a USD file", ()),
    (b"3D Geometry File Format        8" + bytes(80), "a file of Rhino", ()),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "SolidWorks", ()),
    (_zip(), "a ZIP archive", (".3mf",)),
    (gzip.compress(b"v 0 0 0\n" * 900), "packed by gzip", SCANS),
    (bz2.compress(b"v 0 0 0\n" * 900), "packed by bzip2", ()),
    (lzma.compress(b"v 0 0 0\n" * 900), "packed by xz", ()),
    (b"\x28\xb5\x2f\xfd\x04" + bytes(90), "packed by Zstandard", ()),
    (b"7z\xbc\xaf\x27\x1c\0\4" + bytes(90), "an archive", ()),
    (b"\x89HDF\r\n\x1a\n" + bytes(90), "an HDF5 file", ()),
    (b"%PDF-1.7\n", "a document or picture", ()),
    (bytes(128) + b"DICM" + bytes(90), "a DICOM file", ()),
    (b"ObjectType = Image\nNDims = 3\n", "a MetaImage", ()),
    (b"glTF" + struct.pack("<2I", 2, 12), "a glTF file under another name", (".glb", ".gltf")),
    (b"ply\nformat ascii 1.0\n", r"end in \.ply", (".ply",)),
    (b"OFF\n8 12 0\n", r"end in \.off", (".off",)),
    (b"solid a\n  facet normal 0 0 1\n", r"end in \.stl", (".stl",)),
    (b"# vtk DataFile Version 3.0\n", r"end in \.vtk", (".vtk",)),
    (b'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid">', r"end in \.vtu", (".vtu",)),
    (b"$MeshFormat\n4.1 0 8\n", r"end in \.msh", (".msh",)),
    (b"NRRD0004\n", r"end in \.nrrd", SCANS),
    (struct.pack("<i", 348).ljust(344, b"\0") + b"n+1\0" + bytes(90), r"end in \.nii", SCANS),
)


@pytest.mark.parametrize(("data", "words", "kinds"), OTHERS)
@pytest.mark.parametrize("kind", KINDS)
def test_another_thing_is_told_as_what_it_is(
    kind: str, data: bytes, words: str, kinds: tuple[str, ...], tmp_path: Path
) -> None:
    path = tmp_path / f"a{kind}"
    path.write_bytes(data)
    if kind in kinds:
        check_file(path)
    else:
        with pytest.raises(BodyError, match=words) as refused:
            check_file(path)
        assert str(refused.value).startswith(f"{path}: ")


@pytest.mark.parametrize("data", [one[0][:80] for one in OTHERS])
def test_the_header_of_a_binary_stl_may_be_any_text(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_bytes(data.ljust(80, b" ") + struct.pack("<I", 2) + bytes(100))
    check_file(path)


def test_a_name_within_a_text_is_no_pointer(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_bytes(b"solid /data/annex/objects/a.stl\n facet normal 0 0 1\n")
    check_file(path)


@pytest.mark.parametrize(
    ("target", "words"),
    [(".git/annex/objects/x/Y/SHA256E-s1--a.stl", "git annex get"), ("gone.stl", "is a link to a")],
)
def test_a_link_to_a_file_that_is_not_there_is_told(
    target: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.stl"
    path.symlink_to(target)
    with pytest.raises(BodyError, match=words):
        check_file(path)
