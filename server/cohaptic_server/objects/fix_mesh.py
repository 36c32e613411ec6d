"""The value of `--fix-mesh`, FILE[:UNIT][:AXES]: a file, and how its coordinates are to be read.

The value is one text wherever it is given, told, stored and repeated; `FixMesh.of` alone takes it
apart. It reads from the right, and takes only the words that it knows: names of files may have
colons, as `C:\\scans\\bone.stl` has.

Axes are those of a patient. In RAS x points to the right of the patient, y forwards and z up; in
LPS, which 3D Slicer and ITK write, x points to the left and y backwards.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from cohaptic.errors import SettingError

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}  # metres in one unit
_UNIT_WORDS = {"m": "in metres", "cm": "in centimetres", "mm": "in millimetres", "in": "in inches"}
RAS, LPS = "ras", "lps"
_AXES_WORDS = {
    RAS: "with right-anterior-superior axes",
    LPS: "with left-posterior-superior axes",
}
AXES = (RAS, LPS)
FORM = f"FILE[:UNIT][:AXES], with a unit of {', '.join(UNITS)} and axes of {', '.join(AXES)}"
_HEAD = 1024  # bytes at the start of a file that may say its axes
# 3D Slicer writes this into the header of an STL file, comments of PLY and OBJ, and titles of VTK.
_SPACE = re.compile(rb"\bSPACE\s*=\s*(RAS|LPS)\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class FixMesh:
    """A file with the surface that holds an object, and what the user says of its coordinates.

    Args:
        path: Path of the file.
        unit: One of `UNITS`; empty if none is said.
        axes: One of `AXES`; empty if none are said.
    """

    path: Path
    unit: str = ""
    axes: str = ""

    @classmethod
    def of(cls, text: Path) -> FixMesh:
        """Take the value of the option apart; a file that exists is taken by its whole name.

        Raises:
            SettingError: A unit or axes are said twice, or a word behind an existing file is
                neither.
        """
        found, rest = cls(text), str(text)
        while not found.path.is_file():
            rest, colon, last = rest.rpartition(":")
            word = last.lower()
            if not colon or not rest or word not in (*UNITS, *AXES):
                break
            if found.axes if word in AXES else found.unit:
                raise SettingError("--fix-mesh", str(text), f"{FORM}, each once at most")
            said = {"axes": word} if word in AXES else {"unit": word}
            found = replace(found, path=Path(rest), **said)
        if not found.path.is_file():
            _check_rest(text, str(found.path))
        return found

    def __str__(self) -> str:
        return ":".join(filter(None, (str(self.path), self.unit, self.axes)))

    @property
    def option(self) -> str:
        """The option on a command line, in quotes where the path has spaces."""
        text = str(self)
        return f'--fix-mesh "{text}"' if " " in text else f"--fix-mesh {text}"

    def keeps(self, said: FixMesh) -> bool:
        """Whether unit and axes are those that a user says, as far as the user says them."""
        return said.unit in ("", self.unit) and said.axes in ("", self.axes)

    def words(self) -> str:
        """Unit and axes in words: `in millimetres, with left-posterior-superior axes`."""
        said = (_UNIT_WORDS.get(self.unit, ""), _AXES_WORDS.get(self.axes, ""))
        return ", ".join(filter(None, said)) or "as it is"


def _check_rest(text: Path, name: str) -> None:
    """Raise SettingError if words that are not known follow the name of an existing file."""
    file = name
    while ":" in file:
        file = file.rpartition(":")[0]
        if file and Path(file).is_file():
            unknown = name[len(file) + 1 :]
            raise SettingError("--fix-mesh", str(text), f"{FORM}: {unknown!r} is neither")


def said_axes(path: Path) -> str:
    """Axes that a file says in its first bytes, one of `AXES`; empty if it says none, or two."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    # In UTF-16 the letters are every second byte.
    found = {
        match.decode().lower()
        for letters in (head, head[::2], head[1::2])
        for match in _SPACE.findall(letters)
    }
    return found.pop() if len(found) == 1 else ""
