"""Tetrahedra from a file that meshio reads."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats, Ints

VOLUMES = (".msh", ".vtk", ".vtu")


def read_volume(path: Path) -> tuple[Floats, Ints]:
    """Vertices (n, 3), in the units of the file, and tetrahedra (m, 4).

    Of ten-node tetrahedra the corners are taken; a solid makes its own middles.

    Raises:
        BodyError: Not a mesh, or no tetrahedra in it.
    """
    try:
        import meshio

        read: Any = meshio.read  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    except ImportError as error:
        raise BodyError(
            f"{path}: reading {path.suffix} needs meshio; install it with:"
            " pip install 'cohaptic[objects]'"
        ) from error
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints; a server's output is read
            loaded: Any = read(path)
        x = np.array(loaded.points, dtype=np.float64)
        blocks = [
            np.array(cells.data, dtype=np.int64)[:, :4]
            for cells in loaded.cells
            if cells.type in ("tetra", "tetra10")
        ]
        kinds = sorted({str(cells.type) for cells in loaded.cells})
    except SystemExit as error:  # meshio's answer to a file that no reader of its takes
        raise BodyError(f"{path}: this is no mesh that can be read") from error
    except Exception as error:  # and whatever its readers meet
        words = one_line(f"{type(error).__name__}: {error}")
        raise BodyError(f"{path}: this is no mesh that can be read ({words})") from error
    if not blocks or not sum(len(block) for block in blocks):
        raise BodyError(f"{path}: there is no tetrahedron in it, only: {', '.join(kinds) or '-'}")
    return x, np.concatenate(blocks)
