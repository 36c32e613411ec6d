"""Options of an object from a file, the same for every command that takes one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cohaptic_server.bodies.solid.shape import SolidSettings

SOLID = SolidSettings()

Young = Annotated[float, typer.Option(help="Young's modulus E of a file's object [Pa].")]
Poisson = Annotated[float, typer.Option(help="Its Poisson's ratio, 0 to 0.499.")]
Fix = Annotated[str, typer.Option(help='What of it is held: "z < 10%", "x > 2cm".')]
FixMesh = Annotated[
    Path | None,
    typer.Option(help="Hold instead what lies inside this closed surface, of the same --scale."),
]
Scale = Annotated[float, typer.Option(help="Metres in one unit of the file.")]
Edge = Annotated[
    float, typer.Option(help="Edge of a tetrahedron, as a share of the object's diagonal.")
]
Order = Annotated[
    int, typer.Option(help="Of its elements: 2 for accuracy, 1 for large volume meshes.")
]
ContactRadius = Annotated[
    float, typer.Option(help="Radius of a fingertip's pressure [m]; 0 takes 8 mm or more.")
]
Repair = Annotated[
    bool, typer.Option("--repair", help="Close and untangle a surface that needs it.")
]
Simplify = Annotated[
    int, typer.Option(help="Make the surface this many triangles first; 0 leaves it as it is.")
]
