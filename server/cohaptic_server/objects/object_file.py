"""A mesh file, and the options that describe the soft object made from it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.objects.inertia.inertia import Inertia
from cohaptic_server.objects.parts.materials import PartMaterials
from cohaptic_server.touchable import MAX_MEMORY, MAX_TIME

MAX_READ = 5_000_000  # triangles that a file may have if --simplify is given, as for a scan
MAX_TRIANGLES = 300_000  # triangles of a surface to be filled; filling so many takes minutes


@dataclass(frozen=True, slots=True)
class ObjectFile:
    """A mesh file and the options that describe the object in it.

    Args:
        path: Path of the mesh.
        fix: Rule that selects the fixed part (`fix_rule.py`).
        scale: Metres in one unit of the file.
        edge: Target edge length of a tetrahedron, as a share of the bounding box's diagonal.
        repair: Whether fTetWild may close an open surface and resolve self-intersections.
        material: Material and discretisation; also for parts without a material of their own.
        fix_mesh: File of a closed surface in the same units; vertices inside it are fixed.
        simplify: Number of triangles that the surface is simplified to first; 0 keeps them all.
        shell: Thickness given to an open sheet [m]; 0 if the surface is that of a volume.
        max_memory: Limit of the memory for preparing the object, the program included [bytes].
        max_time: Limit of the time for filling the object [s].
        parts: Materials of parts, by their names in the file.
        labels: Labels of a label map that form the object: `3`, a name, or `3=tumour`.
        inertia: Density of the object, if it has any, and damping of its natural modes.

    Raises:
        SettingError: An option is out of its range.
    """

    path: Path
    fix: str = ""
    scale: float = 1.0
    edge: float = 0.05
    repair: bool = False
    material: SolidSettings = field(default_factory=SolidSettings)
    fix_mesh: Path | None = None
    simplify: int = 0
    shell: float = 0.0
    max_memory: float = MAX_MEMORY
    max_time: float = MAX_TIME
    parts: PartMaterials = field(default_factory=PartMaterials)
    labels: tuple[str, ...] = ()
    inertia: Inertia = field(default_factory=Inertia)

    def __post_init__(self) -> None:
        if not 1e-9 <= self.scale <= 1e9:
            raise SettingError("--scale", self.scale, "from 1e-9 to 1e9 metres in a unit")
        if not 0.005 <= self.edge <= 0.5:
            raise SettingError("--edge", self.edge, "from 0.005 to 0.5 of the object's diagonal")
        if self.simplify != 0 and not 100 <= self.simplify <= MAX_TRIANGLES:
            raise SettingError("--simplify", self.simplify, f"0, or from 100 to {MAX_TRIANGLES:,}")
        if self.shell != 0.0 and not 1e-4 <= self.shell <= 1.0:
            raise SettingError("--shell", self.shell, "0, or from 0.0001 to 1 m")
        if not 0.5e9 <= self.max_memory <= 1e13:
            raise SettingError("--max-memory", f"{self.max_memory / 1e9:g} GB", "from 0.5 to 10000")
        if not 1.0 <= self.max_time <= 1e6:
            raise SettingError("--max-time", f"{self.max_time:g} s", "from 1 to 1e6 s")

    def to_arguments(self) -> list[str]:
        """Options of the command line that describe the same object, without the path itself."""
        material = self.material
        arguments = ["--young", repr(material.young), "--poisson", repr(material.nu)]
        arguments += self.parts.to_arguments() + self.inertia.to_arguments()
        for label in self.labels:
            arguments += ["--label", label]
        arguments += ["--order", str(material.order)]
        arguments += ["--contact-radius", repr(material.contact_radius)]
        arguments += ["--scale", repr(self.scale), "--edge", repr(self.edge)]
        arguments += ["--simplify", str(self.simplify), "--shell", repr(self.shell)]
        arguments += ["--max-memory", repr(self.max_memory / 1e9)]
        arguments += ["--max-time", repr(self.max_time)]
        arguments += ["--fix-mesh", str(self.fix_mesh)] if self.fix_mesh else ["--fix", self.fix]
        return arguments + (["--repair"] if self.repair else [])
