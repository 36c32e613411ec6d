"""A mesh file, and the options that describe the soft object made from it.

`OPTIONS` is the one table of these options: the command line, the tables of a file of rooms, the
message of an upload, the limits, and the keys of stored tetrahedra are made from it.

The help of a command needs this module, so it imports the classes of an object's material only when
an object is made.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cohaptic_server.objects.option import Limits, Option, PartOption, words_of
from cohaptic_server.touchable import DAMPING_RATIO, MAX_MEMORY, MAX_TIME, NU, ORDER, YOUNG

if TYPE_CHECKING:
    from cohaptic_server.bodies.solid.shape import SolidSettings
    from cohaptic_server.objects.inertia.inertia import Inertia
    from cohaptic_server.objects.parts.materials import PartMaterials

MAX_READ = 5_000_000  # triangles that a file may have if --simplify is given, as for a scan
MAX_TRIANGLES = 300_000  # triangles of a surface to be filled; filling so many takes minutes
_GB = 1e9  # bytes
_AUTO_MEMORY, _AUTO_TIME = 2.0, 120.0  # limits of a preparation with `--auto` [GB, s]


def _material() -> SolidSettings:
    from cohaptic_server.bodies.solid.shape import SolidSettings

    return SolidSettings()


def _parts() -> PartMaterials:
    from cohaptic_server.objects.parts.materials import PartMaterials

    return PartMaterials()


def _inertia() -> Inertia:
    from cohaptic_server.objects.inertia.inertia import Inertia

    return Inertia()


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
        fix_mesh: File of a closed surface, with its unit and axes (`fix_mesh.py`); vertices inside
            it are fixed.
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
    material: SolidSettings = field(default_factory=_material)
    fix_mesh: Path | None = None
    simplify: int = 0
    shell: float = 0.0
    max_memory: float = MAX_MEMORY
    max_time: float = MAX_TIME
    parts: PartMaterials = field(default_factory=_parts)
    labels: tuple[str, ...] = ()
    inertia: Inertia = field(default_factory=_inertia)

    def __post_init__(self) -> None:
        for option in OPTIONS:
            option.check(self)

    @classmethod
    def of(cls, path: Path, given: Mapping[str, Any]) -> ObjectFile:
        """Return the object in a file with options as they are given, by their names.

        Raises:
            SettingError: An option is out of its range.
            TypeError, ValueError, OverflowError: A value is of another type than its option.
        """
        values: dict[str, Any] = {}
        for option in OPTIONS:
            if option.name in given:
                values |= option.read(given[option.name])
        return cls(path).changed(values)

    def changed(self, values: Mapping[str, Any]) -> ObjectFile:
        """Return this object with other values of some attributes, such as `material.order`.

        Raises:
            SettingError: A value is out of its range.
        """
        groups: dict[str, dict[str, Any]] = {"": {}}
        for attribute, value in values.items():
            group, _, name = attribute.rpartition(".")
            groups.setdefault(group, {})[name] = value
        own = groups.pop("")
        own |= {group: replace(getattr(self, group), **inner) for group, inner in groups.items()}
        return replace(self, **own)

    def to_arguments(self) -> list[str]:
        """Options of the command line that describe the same object, without the path itself.

        Numbers are always among them, but for a density that nothing has, so that another version
        with other defaults makes the same object. The material comes first, then the mesh, then the
        held region.
        """
        given = {option.name: option.given(self) for option in OPTIONS}
        written = [
            words_of(option, given[option.name])
            for option in sorted(OPTIONS, key=_rank)
            if given.get(option.only_with, True) or given[option.name] != option.absent
        ]
        return [word for words in written for word in words]


def _rank(option: Option) -> tuple[bool, bool, bool]:
    """Rank of an option in `to_arguments`; options of one rank are in the order of the help."""
    is_mesh = "." not in option.attribute and option.kind is not tuple
    return option.kind is bool, option.kind in (str, Path), is_mesh


# In the order of the help, which is that of the values in the keys of stored tetrahedra, too.
_ROWS = (
    PartOption(
        "young", "Young's modulus [Pa], or that of a part: --young tumour=60e3.",
        at="material.young", parts="parts.young", every="parts.every_young",
        shown=f"{YOUNG:g}; with --auto a press is felt", page=True, chosen=True,
    ),
    PartOption(
        "poisson", "Poisson's ratio, 0 to 0.499, or that of a part: --poisson tumour=0.4.",
        at="material.nu", parts="parts.nu", every="parts.every_nu", shown=f"{NU:g}", page=True,
    ),
    Option("fix", 'Region that is held: "z < 10%", "x > 2cm".', page=True, chosen=True),
    Option(
        "fix_mesh", "File with a closed surface: hold the region inside it, in place of --fix."
        " FILE:mm:lps says its unit (m, cm, mm, in) and axes (ras, lps). A scan is ras, and so is"
        " an object that says none: lps turns x and y round.",
        kind=Path, optional=True,
    ),
    Option(
        "scale", "Length of one unit of the file [m]: 0.001 for millimetres; else 1.",
        limits=Limits(1e-9, 1e9, "from 1e-9 to 1e9 metres in a unit"),
        optional=True, tets=True, page=True, chosen=True,
    ),
    Option(
        "edge", "Edge of a tetrahedron, as a share of the object's diagonal.",
        limits=Limits(0.005, 0.5, "from 0.005 to 0.5 of the object's diagonal"),
        tets=True, chosen=True,
    ),
    Option(
        "order", "Order of the elements: 2 is accurate, 1 for large volume meshes.",
        at="material.order", default=ORDER, chosen=True,
    ),
    Option(
        "contact_radius", "Radius of a fingertip's pressure [m]; 0 chooses 8 mm or more.",
        at="material.contact_radius", default=0.0,
    ),
    Option(
        "repair", "Close and untangle a surface; of a volume mesh, take the largest piece.",
        tets=True, chosen=True,
    ),
    Option(
        "simplify", "Reduce the surface to so many triangles first; 0 keeps all.",
        limits=Limits(100, MAX_TRIANGLES, f"0, or from 100 to {MAX_TRIANGLES:,}", zero=True),
        tets=True, chosen=True,
    ),
    Option(
        "shell", "Thickness for a file that is an open sheet [m]; 0 for a volume.",
        limits=Limits(1e-4, 1.0, "0, or from 0.0001 to 1 m", zero=True), tets=True, chosen=True,
    ),
    Option(
        "max_memory", "Limit of the memory that the preparation takes [GB].", unit=_GB,
        limits=Limits(0.5e9, 1e13, "from 0.5 to 10000", reported="{:g} GB"), optional=True,
        shown=f"{MAX_MEMORY / _GB:g}; {_AUTO_MEMORY:g} with --auto", auto=_AUTO_MEMORY,
    ),
    Option(
        "max_time", "Limit of the time to fill it with tetrahedra [s].",
        limits=Limits(1.0, 1e6, "from 1 to 1e6 s", reported="{:g} s"), optional=True,
        shown=f"{MAX_TIME:g}; {_AUTO_TIME:g} with --auto", auto=_AUTO_TIME,
    ),
    Option(
        "label", "Label of a segmented scan that belongs to the object: 3, 3=tumour.",
        at="labels", optional=True, tets=True, chosen=True,
    ),
    PartOption(
        "density", "Density [kg/m3], or that of a part, NAME=1100: the object then swings as a"
        " jelly does. Water and tissue have 1000.",
        at="inertia.density", parts="inertia.densities", shown="no mass",
    ),
    Option(
        "damping_ratio", "Damping ratio of the swings, 0.02 to 0.95; jelly and tissue: 0.1.",
        at="inertia.damping", default=DAMPING_RATIO, only_with="density",
    ),
)  # fmt: skip
_DEFAULTS = {one.name: one.default for one in fields(ObjectFile)}


def _complete(option: Option) -> Option:
    """Take an option's default from the field of `ObjectFile`, and its type from the default."""
    default = _DEFAULTS.get(option.attribute) if option.default is None else option.default
    return replace(option, default=default, kind=option.kind or type(default))


OPTIONS: tuple[Option, ...] = tuple(_complete(row) for row in _ROWS)
