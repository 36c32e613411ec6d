"""Names of all bodies, kinds of object files, and default material and limits of such objects.

The command line shows these values in its help, so this module imports no module that uses them.
"""

from __future__ import annotations

from pathlib import Path

from cohaptic.extensions import added

BALLOON, SPRING = "balloon", "spring"
GROUP = "cohaptic.bodies"  # group of entry points: functions without arguments that return a `Body`

# Kinds of files, by their suffixes.
SURFACES = (".stl", ".obj", ".ply", ".glb", ".gltf", ".3mf", ".off")
VOLUMES = (".msh", ".vtk", ".vtu")
SCANS = (".nii", ".nii.gz", ".nrrd")
KINDS = SURFACES + VOLUMES + SCANS

YOUNG = 2e4  # Pa; soft tissue has 1e3 to 1e5, rubber 1e6
NU = 0.45  # Poisson's ratio
ORDER = 2  # of the elements; see docs/design/solid.md
# Damping over critical damping, which is half of the loss factor at a resonance: an oscillation
# halves in one period. For gels and soft tissue this value is an order of magnitude, not a
# measurement.
DAMPING_RATIO = 0.1
MAX_MEMORY = 6e9  # bytes that preparing an object may take
MAX_TIME = 1800.0  # s that filling an object with tetrahedra may take


def names() -> list[str]:
    """Return the names of all bodies that need no file: built-in ones, then other packages'."""
    return list(dict.fromkeys((BALLOON, SPRING, *added(GROUP))))


def kind_of(name: str) -> str:
    """Return the kind of a file: the suffix of its name, with the dot and in lower case.

    Args:
        name: Name of the file, with or without folders.

    Returns:
        The longest of `KINDS` with which the name ends; if there is none, the part from the last
        dot on, or an empty text without a dot.
    """
    low = name.lower()
    last = f".{low.rpartition('.')[2]}" if "." in low else ""
    return max((kind for kind in KINDS if low.endswith(kind)), key=len, default=last)


def is_file(name: str) -> bool:
    """Whether the name of a body is the path of a file: it has a suffix or a folder."""
    return bool(Path(name).suffix) or "/" in name or "\\" in name
