"""What can be touched, and what an object from a file has where nothing is said of it.

The command line shows these in its help, so this module imports nothing of what they belong to.
"""

from __future__ import annotations

from pathlib import Path

from cohaptic.extensions import added

BALLOON, SPRING = "balloon", "spring"
GROUP = "cohaptic.bodies"  # of entry points, each of which is called and returns a `Body`

# Kinds of files, by their suffixes.
SURFACES = (".stl", ".obj", ".ply", ".glb", ".gltf", ".3mf", ".off")
VOLUMES = (".msh", ".vtk", ".vtu")
SCANS = (".nii", ".nii.gz", ".nrrd")
KINDS = SURFACES + VOLUMES + SCANS

YOUNG = 2e4  # Pa; soft tissue has 1e3 to 1e5, rubber 1e6
NU = 0.45  # Poisson's ratio
ORDER = 2  # of the elements; see docs/decisions/0013
# Share of critical damping, half of the loss factor at a resonance. For gels and soft tissue it is
# an order of magnitude and no measurement: with it a swing falls by the half in one period.
DAMPING_RATIO = 0.1
MAX_MEMORY = 6e9  # bytes that preparing an object may take
MAX_TIME = 1800.0  # s that filling it may take


def names() -> list[str]:
    """Names of all bodies that are no files: ours first, then those that packages add."""
    return list(dict.fromkeys((BALLOON, SPRING, *added(GROUP))))


def kind_of(name: str) -> str:
    """Kind of a file by its name, in small letters and with the point; empty without a point.

    Args:
        name: Name of the file, with or without folders.

    Returns:
        The longest of `KINDS` that the name ends with, and else what follows its last point.
    """
    low = name.lower()
    last = f".{low.rpartition('.')[2]}" if "." in low else ""
    return max((kind for kind in KINDS if low.endswith(kind)), key=len, default=last)


def is_file(name: str) -> bool:
    """Whether a body's name is a path: it has a suffix or a folder."""
    return bool(Path(name).suffix) or "/" in name or "\\" in name
