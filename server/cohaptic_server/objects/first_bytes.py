"""Tells a file that is something else than its name says, by its first bytes.

People rename files, and download pages, archives and pointers in place of what they wanted. A
reader of meshes would say of each that there is no triangle in it; the first bytes say what it is.
"""

from __future__ import annotations

import os
import re
import struct
from pathlib import Path
from typing import NamedTuple

from cohaptic.errors import BodyError
from cohaptic_server.touchable import SCANS, kind_of

START = 4096  # bytes that show what a file is
GZIP = b"\x1f\x8b"
_STL_HEADER, _STL_TRIANGLE = 84, 50  # bytes of a binary STL before its triangles, and of each


class _Other(NamedTuple):
    """Another kind of file.

    Args:
        start: Expression for its first bytes, after white space.
        words: What it is, and the way out.
        kinds: Kinds of files that begin so by right.
    """

    start: re.Pattern[bytes]
    words: str
    kinds: tuple[str, ...] = ()


_ANNEX = "a pointer of git-annex, and not the file itself. Get that: git annex get"
_AS_GLTF = "Open it in Blender, and export it from there as glTF (.glb)"
_UNPACK = "Unpack it first, and give the file that is in it"


def _renamed(name: str, *kinds: str) -> str:
    return f"{name} under another name. Let its name end in {' or '.join(kinds)}"


def _other(start: bytes, words: str, kinds: tuple[str, ...] = (), flags: int = 0) -> _Other:
    return _Other(re.compile(start, flags | re.S), words, kinds)


_OTHERS = (
    _other(rb"version https://git-lfs",
           "a pointer of Git LFS, and not the file itself. Get that: git lfs pull"),
    _other(rb"(?:(?:\.\.[/\\])*\.git)?[/\\]annex[/\\]objects[/\\]", _ANNEX),
    _other(rb"(?:<\?xml[^>]*>\s*)?(?:<!--.{0,1000}?-->\s*)?<(?:!doctype html|html)",
           "a web page. Save the file itself, not the page about it", (), re.I),
    _other(rb"(?:<\?xml[^>]*>\s*)?<Error>",
           "an error message of the place that it was loaded from. Load it anew"),
    _other(rb"ISO-10303-21",
           "a STEP file, which has exact surfaces and no mesh. Export a mesh from the program that"
           " made it: 3MF or STL, or let Gmsh mesh it and save it as .msh"),
    _other(rb"[^\r\n]{72}S {0,6}0{0,6}1\s",
           "an IGES file, which has exact surfaces and no mesh. Export a mesh from the program that"
           " made it: 3MF or STL"),
    _other(rb"Kaydara FBX Binary|; FBX \d", f"an FBX file. {_AS_GLTF}"),
    _other(rb"BLENDER[-_0-9]", f"a scene of Blender. {_AS_GLTF}"),
    _other(rb"(?:<\?xml[^>]*>\s*)?(?:<!--.{0,1000}?-->\s*)?<COLLADA",
           f"a Collada file. {_AS_GLTF}"),
    _other(rb"PXR-USDC|#usda", f"a USD file. {_AS_GLTF}"),
    _other(rb"3D Geometry File Format", "a file of Rhino. Export a mesh from there: 3MF or STL"),
    _other(rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
           "a document of SolidWorks or another program of its kind. Export a mesh from there: 3MF"
           " or STL"),
    _other(rb"PK(?:\x03\x04|\x05\x06|\x07\x08)",
           f"a ZIP archive. {_UNPACK}; if it is a 3MF file, let its name end in .3mf", (".3mf",)),
    _other(re.escape(GZIP), f"packed by gzip. {_UNPACK}: gunzip", SCANS),
    _other(rb"BZh[1-9]1AY", f"packed by bzip2. {_UNPACK}"),
    _other(rb"\xfd7zXZ\0", f"packed by xz. {_UNPACK}"),
    _other(rb"\x28\xb5\x2f\xfd",
           f"packed by Zstandard, as scenes of Blender are. {_UNPACK}, or export it from Blender"
           " as glTF (.glb)"),
    _other(rb"7z\xbc\xaf\x27\x1c|Rar!\x1a\x07", f"an archive. {_UNPACK}"),
    _other(rb"\x89HDF\r\n\x1a\n", "an HDF5 file. Save it from its program as .vtu"),
    _other(rb"%PDF-|\x89PNG\r\n|\xff\xd8\xff", "a document or picture, and no object"),
    _other(rb".{128}DICM",
           "a DICOM file, as scanners write them. Segment the organ, for example in 3D Slicer, and"
           " save the label map as .nii.gz or .nrrd"),
    _other(rb"(?:ObjectType\s*=\s*Image|NDims\s*=)",
           "a MetaImage, which is not read. Save the label map as .nii.gz or .nrrd"),
    _other(rb"glTF[\x01\x02]\0\0\0", _renamed("a glTF file", ".glb"), (".glb", ".gltf")),
    _other(rb"ply\r?\n(?:comment|obj_info|format)", _renamed("a PLY file", ".ply"), (".ply",)),
    _other(rb"(?:ST|C|N|4)*OFF\s", _renamed("an OFF file", ".off"), (".off",)),
    _other(rb"solid[^\n]*\n\s*facet\s", _renamed("an STL file", ".stl"), (".stl",)),
    _other(rb"# vtk DataFile", _renamed("a VTK file", ".vtk"), (".vtk",)),
    _other(rb"(?:<\?xml[^>]*>\s*)?<VTKFile\s", _renamed("a VTK file", ".vtu"), (".vtu",)),
    _other(rb"\$MeshFormat", _renamed("a mesh of Gmsh", ".msh"), (".msh",)),
    _other(rb"NRRD000\d", _renamed("an NRRD file", ".nrrd"), SCANS),
    _other(rb".{344}n(?:\+|i)1\x00|.{4}n(?:\+|i)2\0\r\n", _renamed("a NIfTI file", ".nii"), SCANS),
)  # fmt: skip


def check_start(path: Path, data: bytes) -> None:
    """Check that the first bytes of a file are not those of another kind than its name says.

    Args:
        path: The file.
        data: Its first bytes, of which `START` are looked at.

    Raises:
        BodyError: The file is empty, or something else altogether.
    """
    start = data[:START]
    # The first 80 bytes of a binary STL are free, and may be any text.
    if kind_of(path.name) == ".stl" and _is_stl(start, path.stat().st_size):
        return
    if not start.strip():
        raise BodyError(f"{path}: the file is empty")
    for other in _OTHERS:
        if kind_of(path.name) not in other.kinds and (
            other.start.match(start) or other.start.match(_text_of(start))
        ):
            raise BodyError(f"{path}: it is {other.words}")


def _text_of(start: bytes) -> bytes:
    """The first bytes without a byte order mark, and without white space before the text."""
    return start.removeprefix(b"\xef\xbb\xbf").lstrip()


def _is_stl(start: bytes, size: int) -> bool:
    """Whether a file has the size that it would have as a binary STL with triangles."""
    if len(start) < _STL_HEADER:
        return False
    count = int(struct.unpack_from("<I", start, _STL_HEADER - 4)[0])
    return count > 0 and size == _STL_HEADER + _STL_TRIANGLE * count


def check_link(path: Path) -> None:
    """Check that a path is no link to a file that is not there, as git-annex leaves them.

    Raises:
        BodyError: It is one.
    """
    if not path.is_symlink() or path.exists():
        return
    if b"annex/objects/" in os.fsencode(os.readlink(path)):
        raise BodyError(f"{path}: it is {_ANNEX}")
    raise BodyError(f"{path}: it is a link to a file that is not there")
