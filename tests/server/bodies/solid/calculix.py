"""CalculiX, an independent finite element program, as a measure: write a deck, run it, read it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.numeric import Floats
from tests.patience import PATIENCE

CCX = shutil.which("ccx")


def displacement(body: Solid, loads: list[Load], folder: Path) -> Floats:
    """Displacement of every node of a solid under loads as CalculiX has it, shape (n, 3) [m]."""
    assert CCX is not None
    (folder / "solid.inp").write_text(deck(body, loads))
    done = subprocess.run(
        [CCX, "-i", "solid"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    rows = [
        [float(word) for word in line.split()]
        for line in (folder / "solid.dat").read_text().splitlines()
        if len(line.split()) == 4 and line.split()[0].isdigit()
    ]
    table = np.array(rows)
    u = np.full((len(body.shape.nodes), 3), np.nan)
    u[table[:, 0].astype(int) - 1] = table[:, 1:]
    return u


def deck(body: Solid, loads: list[Load]) -> str:
    """The same nodes, elements, material, held nodes and forces, as CalculiX reads them."""
    kind = {4: "C3D4", 10: "C3D10"}[body.shape.elements.shape[1]]
    forces = np.zeros((len(body.shape.nodes), 3))
    for load in loads:
        fraction = load.force * load.weights[:, None] * load.direction
        np.add.at(forces, body.shape.surface[load.vertices], fraction)
    lines = ["*NODE, NSET=ALL"]
    lines += [
        f"{k + 1}, {x:.11e}, {y:.11e}, {z:.11e}" for k, (x, y, z) in enumerate(body.shape.nodes)
    ]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=SOLID")
    lines += [
        ", ".join(str(k) for k in (number + 1, *(element + 1).tolist()))
        for number, element in enumerate(body.shape.elements)
    ]
    lines += ["*MATERIAL, NAME=SOFT", "*ELASTIC", f"{body.settings.young}, {body.settings.nu}"]
    lines += ["*SOLID SECTION, ELSET=SOLID, MATERIAL=SOFT", "*BOUNDARY"]
    lines += [f"{k + 1}, 1, 3" for k in np.flatnonzero(body.shape.fixed)]
    lines += ["*STEP", "*STATIC", "*CLOAD"]
    lines += [
        f"{k + 1}, {axis + 1}, {forces[k, axis]:.11e}" for k, axis in np.argwhere(forces).tolist()
    ]
    return "\n".join([*lines, "*NODE PRINT, NSET=ALL", "U", "*END STEP", ""])
