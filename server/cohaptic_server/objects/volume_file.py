"""Reads the tetrahedra of a volume mesh, through meshio."""

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
    """Read vertices, shape (n, 3) in units of the file, and tetrahedra, shape (m, 4).

    Only the corners of ten-node tetrahedra are kept; a solid adds its own midside nodes.

    Args:
        path: A file of one of `VOLUMES`.

    Raises:
        BodyError: The file is not a mesh, or has no tetrahedra in it.
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
        # meshio prints, and scripts read a server's output.
        with contextlib.redirect_stdout(io.StringIO()):
            loaded: Any = read(path)
        x = np.array(loaded.points, dtype=np.float64)
        blocks = [
            np.array(cells.data, dtype=np.int64)[:, :4]
            for cells in loaded.cells
            if cells.type in ("tetra", "tetra10")
        ]
        kinds = sorted({str(cells.type) for cells in loaded.cells})
    except SystemExit as error:  # raised by meshio if no reader accepts the file
        raise BodyError(f"{path}: this is no mesh that can be read") from error
    except Exception as error:  # meshio's readers raise errors of many kinds
        words = one_line(f"{type(error).__name__}: {error}")
        raise BodyError(f"{path}: this is no mesh that can be read ({words})") from error
    if not blocks or not sum(len(block) for block in blocks):
        raise BodyError(f"{path}: there is no tetrahedron in it, only: {', '.join(kinds) or '-'}")
    return x, np.concatenate(blocks)
