"""What was made of a file, kept on disk: its tetrahedra, and what makes a solid of them.

Two keys, both of content: the bytes of the file and everything that decides which tetrahedra they
become; the tetrahedra, what of them is held, and the material.
"""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.far_field import FarField
from cohaptic_server.bodies.solid.parts import SolidParts, make_parts
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.cholesky import factor_file
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.objects.object_file import ObjectFile, Prepared, prepare
from cohaptic_server.objects.store.cache import damaged, fetch, keep, place
from cohaptic_server.objects.surface.checks import SurfaceReport
from cohaptic_server.progress import Progress

_FORM = 3  # raised when what is stored, or how it is made, changes


def prepared(wanted: ObjectFile) -> Prepared:
    """Tetrahedra from the store, or made and stored; raises as `object_file.prepare`."""
    if not wanted.path.is_file():
        return prepare(wanted)  # which says what is wrong
    shape = (wanted.scale, wanted.edge, wanted.repair, wanted.simplify)
    words = (_FORM, wanted.path.suffix.lower(), *shape)
    where = place(repr(words).encode(), wanted.path.read_bytes())
    arrays = fetch(where, f"tetrahedra of {wanted.path.name}", mapped=False)
    if arrays is not None:
        try:
            tets = TetMesh.checked(arrays["vertices"], arrays["tets"])
            triangles, left = arrays["triangles"].tolist()
            return Prepared(tets, _report(arrays["report"].tolist()), triangles, left)
        except (KeyError, TypeError, ValueError, BodyError) as error:
            damaged(f"tetrahedra of {wanted.path.name}", error)
    found = prepare(wanted)
    report = () if found.surface is None else astuple(found.surface)
    keep(
        where,
        f"tetrahedra of {wanted.path.name}",
        {
            "vertices": found.tets.vertices,
            "tets": found.tets.tets,
            "report": np.array(report, dtype=np.float64),
            "triangles": np.array([found.triangles, found.simplified], dtype=np.int64),
        },
    )
    return found


def _report(values: list[float]) -> SurfaceReport | None:
    if not values:
        return None
    counts = (int(value) for value in values[:4])
    return SurfaceReport(*counts, *values[4:])


def parts_of(
    tets: TetMesh, held: npt.NDArray[np.bool_], settings: SolidSettings, progress: Progress
) -> SolidParts:
    """Factor and far field from the store, mapped and not read, or made and stored."""
    material = (_FORM, settings.young, settings.nu, settings.contact_radius, settings.order)
    where = place(
        repr(material).encode(), tets.vertices.tobytes(), tets.tets.tobytes(), held.tobytes()
    )
    arrays = fetch(where, "factor")
    if arrays is not None:
        try:
            return SolidParts(
                factor_file.from_arrays(_under("factor/", arrays)),
                FarField.from_arrays(_under("twin/", arrays)),
            )
        except (KeyError, ValueError, IndexError, BodyError) as error:
            damaged("factor", error)
    parts = make_parts(tets, held, settings, progress)
    progress("storing", 0.0)
    whole = _over("factor/", factor_file.to_arrays(parts.factor)) | _over(
        "twin/", parts.far_field.to_arrays()
    )
    keep(where, "factor", whole)
    return parts


def _over(prefix: str, arrays: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    return {prefix + name: array for name, array in arrays.items()}


def _under(prefix: str, arrays: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
