from __future__ import annotations

from pathlib import Path, PureWindowsPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.objects.fix_mesh import AXES, UNITS, FixMesh, said_axes
from tests.server.objects.files import write

KNOWN = (*UNITS, *AXES)
names = st.text(min_size=1, max_size=12).map(lambda name: f"{name}.stl")
units, axes = st.sampled_from(["", *UNITS]), st.sampled_from(["", *AXES])


@given(names, units, axes)
def test_a_value_says_what_its_text_says(name: str, unit: str, axes: str) -> None:
    """The text is what commands repeat, files of rooms hold and the store keeps."""
    said = FixMesh(Path(name), unit, axes)
    assert FixMesh.of(Path(str(said))) == said


@pytest.mark.parametrize(
    ("text", "path", "unit", "axes"),
    [
        ("bone.stl", "bone.stl", "", ""),
        (r"C:\scans\bone.stl", r"C:\scans\bone.stl", "", ""),
        (r"C:\scans\bone.stl:mm:lps", r"C:\scans\bone.stl", "mm", "lps"),
        ("12:30 bone.stl:RAS", "12:30 bone.stl", "", "ras"),
        ("bone.stl:km", "bone.stl:km", "", ""),
        ("bone.stl:mm:", "bone.stl:mm:", "", ""),
        ("bone.stl:", "bone.stl:", "", ""),
        (":mm", ":mm", "", ""),
        ("mm:lps", "mm", "", "lps"),
    ],
)
def test_only_known_words_behind_the_last_colons_are_taken(
    text: str, path: str, unit: str, axes: str
) -> None:
    assert FixMesh.of(Path(text)) == FixMesh(Path(path), unit, axes)
    assert str(PureWindowsPath(text)) == text  # so it is a path there as well


def test_a_file_that_exists_is_taken_by_its_whole_name(tmp_path: Path) -> None:
    odd = tmp_path / "bone:mm"
    try:
        odd.touch()
    except OSError:
        pytest.skip("this system has no colons in names")
    assert FixMesh.of(odd) == FixMesh(odd)
    assert FixMesh.of(Path(f"{odd}:cm:lps")) == FixMesh(odd, "cm", "lps")


@pytest.mark.parametrize("rest", ["km", "mm:las", "m m", "", "mm:", "millimetre:lps", ":mm"])
def test_rubbish_behind_a_file_that_exists_is_named(tmp_path: Path, rest: str) -> None:
    path = write(tmp_path / "bone.stl", *icosphere(1, 1.0))
    with pytest.raises(SettingError) as caught:
        FixMesh.of(Path(f"{path}:{rest}"))
    for word in KNOWN:
        assert word in caught.value.limit
    assert caught.value.limit.endswith(" is neither")


def header(kind: str, words: str) -> bytes:
    """The start of a file of a kind that says some words, as 3D Slicer writes it."""
    binary: dict[str, bytes] = {
        "stl": words.encode().ljust(80, b"\0") + b"P\0\0\0" + bytes(50),
        "text.stl": f"solid {words}\nfacet normal 0 0 1\n".encode(),
        "ply": f"ply\nformat ascii 1.0\ncomment {words}\nelement vertex 3\n".encode(),
        "obj": f"# {words}\nv 0 0 0\n".encode(),
        "vtk": f"# vtk DataFile Version 5.1\n{words}\nASCII\n".encode(),
        "utf16.obj": f"# {words}\nv 0 0 0\n".encode("utf-16"),
    }
    return binary[kind]


@pytest.mark.parametrize("kind", ["stl", "text.stl", "ply", "obj", "vtk", "utf16.obj"])
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("3D Slicer output. SPACE=LPS", "lps"),
        ("3D Slicer output. SPACE=RAS;", "ras"),
        ("space = lps", "lps"),
        ("SPACE=LPSX", ""),
        ("NOSPACE=LPS", ""),
        ("SPACE=LAS", ""),
        ("SPACE=LPS SPACE=RAS", ""),
        ("SPACE=LPS SPACE=LPS", "lps"),
        ("", ""),
    ],
)
def test_axes_are_found_where_a_file_says_them(
    tmp_path: Path, kind: str, words: str, expected: str
) -> None:
    path = tmp_path / f"a.{kind}"
    path.write_bytes(header(kind, words))
    assert said_axes(path) == expected


def test_bytes_that_are_no_text_say_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_bytes(bytes(range(256)) * 8)
    assert said_axes(path) == ""
