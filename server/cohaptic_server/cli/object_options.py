"""Command-line options of an object from a file, for every command that takes such an object."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cohaptic_server.cli.option_groups import takes
from cohaptic_server.touchable import DAMPING_RATIO, MAX_MEMORY, MAX_TIME, NU, ORDER, YOUNG

if TYPE_CHECKING:
    from cohaptic_server.objects.object_file import ObjectFile

AUTO_MEMORY, AUTO_TIME = 2e9, 120.0  # limits of a preparation with `--auto` [bytes, s]


@dataclass(frozen=True, slots=True)
class ObjectOptions:
    """Options of an object from a file, as they were given; each field is one option."""

    young: Annotated[
        list[str] | None,
        typer.Option(
            help="Young's modulus [Pa], or that of a part: --young tumour=60e3.",
            show_default=f"{YOUNG:g}",
        ),
    ] = None
    poisson: Annotated[
        list[str] | None,
        typer.Option(
            help="Poisson's ratio, 0 to 0.499, or that of a part: --poisson tumour=0.4.",
            show_default=f"{NU:g}",
        ),
    ] = None
    fix: Annotated[str, typer.Option(help='Region that is held: "z < 10%", "x > 2cm".')] = ""
    fix_mesh: Annotated[
        Path | None,
        typer.Option(
            help="File with a closed surface: hold the region inside it, in place of --fix."
        ),
    ] = None
    scale: Annotated[
        float | None,
        typer.Option(help="Length of one unit of the file [m]: 0.001 for millimetres; else 1."),
    ] = None
    edge: Annotated[
        float, typer.Option(help="Edge of a tetrahedron, as a share of the object's diagonal.")
    ] = 0.05
    order: Annotated[
        int, typer.Option(help="Order of the elements: 2 is accurate, 1 for large volume meshes.")
    ] = ORDER
    contact_radius: Annotated[
        float, typer.Option(help="Radius of a fingertip's pressure [m]; 0 chooses 8 mm or more.")
    ] = 0.0
    repair: Annotated[
        bool,
        typer.Option(
            "--repair", help="Close and untangle a surface that is open or crosses itself."
        ),
    ] = False
    simplify: Annotated[
        int,
        typer.Option(help="Reduce the surface to so many triangles first; 0 keeps all."),
    ] = 0
    shell: Annotated[
        float, typer.Option(help="Thickness for a file that is an open sheet [m]; 0 for a volume.")
    ] = 0.0
    max_memory: Annotated[
        float | None,
        typer.Option(
            help="Limit of the memory that the preparation takes [GB].",
            show_default=f"{MAX_MEMORY / 1e9:g}; {AUTO_MEMORY / 1e9:g} with --auto",
        ),
    ] = None
    max_time: Annotated[
        float | None,
        typer.Option(
            help="Limit of the time to fill it with tetrahedra [s].",
            show_default=f"{MAX_TIME:g}; {AUTO_TIME:g} with --auto",
        ),
    ] = None
    label: Annotated[
        list[str] | None,
        typer.Option(help="Label of a segmented scan that belongs to the object: 3, 3=tumour."),
    ] = None
    density: Annotated[
        list[str] | None,
        typer.Option(
            help="Density [kg/m3], or that of a part, NAME=1100: the object then swings as a jelly"
            " does. Water and tissue have 1000.",
            show_default="no mass",
        ),
    ] = None
    damping_ratio: Annotated[
        float,
        typer.Option(help="Damping ratio of the swings, 0.02 to 0.95; jelly and tissue: 0.1."),
    ] = DAMPING_RATIO
    auto: Annotated[
        bool,
        typer.Option(
            "--auto",
            help="Choose unit, held region, repair and mesh where not given, and say why.",
        ),
    ] = False

    def of(self, path: Path) -> ObjectFile:
        """Return the object in the file `path`, with these options.

        Raises:
            SettingError: An option is out of its range.
        """
        from cohaptic_server.bodies.solid.shape import SolidSettings
        from cohaptic_server.objects.inertia.inertia import Inertia
        from cohaptic_server.objects.object_file import ObjectFile
        from cohaptic_server.objects.parts.materials import PartMaterials, parse_values

        memory = AUTO_MEMORY if self.auto else MAX_MEMORY
        young, young_of = parse_values("--young", self.young or ())
        nu, nu_of = parse_values("--poisson", self.poisson or ())
        material = SolidSettings(
            YOUNG if young is None else young,
            NU if nu is None else nu,
            self.contact_radius,
            self.order,
        )
        return ObjectFile(
            path,
            self.fix,
            1.0 if self.scale is None else self.scale,
            self.edge,
            self.repair,
            material,
            self.fix_mesh,
            self.simplify,
            self.shell,
            memory if self.max_memory is None else 1e9 * self.max_memory,
            (AUTO_TIME if self.auto else MAX_TIME) if self.max_time is None else self.max_time,
            PartMaterials(
                young_of, nu_of, bool(young_of) and young is None, bool(nu_of) and nu is None
            ),
            tuple(self.label or ()),
            Inertia(*parse_values("--density", self.density or ()), self.damping_ratio),
        )


takes_object = takes(ObjectOptions, "Object from a file")

SimulationHz = Annotated[
    float, typer.Option("--simulation-hz", "--hz", help="Rate of the simulation, 10 to 200 [Hz].")
]
Users = Annotated[
    int | None,
    typer.Option(
        help="Make the mesh coarse enough for so many users at once; refuse where none is.",
        show_default="2 with --nonlinear, else none",
    ),
]
