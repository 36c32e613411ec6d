"""Stores prepared objects on disk: tetrahedra of a file, and the expensive parts of a solid.

The key of each entry is the input that it was computed from: for tetrahedra the bytes of the file
and all options that influence them, for parts of a solid the tetrahedra, the fixed vertices and the
material. An object of one material has one entry for every Young's modulus E, which is not in the
key: its stiffness is in proportion to E, so that the parts for `YOUNG` are multiplied when they are
loaded.

A factor is kept in a file of its own from the end of factoring until the whole object is stored.
It is in double precision, which the presses on the surface need; the factor in the stored object
is in single precision.

With `late` the result has only the path of a stored factor: the process that solves with the factor
maps its file, and no other process reads it.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import astuple, replace
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.far_field import FarField
from cohaptic_server.bodies.solid.parts import SolidParts, make_parts
from cohaptic_server.bodies.solid.shape import Moduli, SolidSettings, SolidShape, shape_of
from cohaptic_server.cholesky import factor_file
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factor_file import from_arrays
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.objects.object_file import OPTIONS, ObjectFile
from cohaptic_server.objects.parts.parts import Parts
from cohaptic_server.objects.prepare import Prepared, prepare
from cohaptic_server.objects.store.cache import (
    SUFFIX,
    entry_path,
    has_entry,
    load_entry,
    read_arrays,
    save_entry,
    warn_unusable,
)
from cohaptic_server.objects.surface.checks import SurfaceReport
from cohaptic_server.progress import Progress
from cohaptic_server.touchable import YOUNG

PREFIX = "factor/"  # prefix of the factor's arrays in an entry


class StoredFactor:
    """A stored factor, which the process that solves with it reads only when it needs it.

    Args:
        path: Path of the entry with the factor.
        count: Memory of the factor's numbers [bytes].
        multiple: The wanted factor's matrix over that of the stored one.

    Attributes:
        bytes: Memory of the factor's numbers [bytes].
    """

    def __init__(self, path: Path, count: int, multiple: float = 1.0) -> None:
        self.path, self.bytes = path, count
        self._multiple = multiple
        self._file: BufferedReader | None = None
        self._seen: tuple[int, int] | None = None

    def read(self) -> Factor:
        """Map the factor from its file; a damaged entry is deleted, so that it is made anew.

        Raises:
            BodyError: The entry is damaged.
            OSError: The file cannot be read.
        """
        # The file stays open, since the entry may be deleted from the folder while it is mapped.
        self._file = self.path.open("rb")
        self._seen = _state(self._file)
        try:
            stored = from_arrays(read_arrays(self._file, self.path, under=PREFIX))
            return stored.times(self._multiple)
        except (BodyError, ValueError, KeyError, TypeError) as error:
            with contextlib.suppress(OSError):
                self.path.unlink()
            raise BodyError(f"the stored factor is damaged, and was deleted ({error})") from error

    def problem(self) -> str:
        """Error text if the file of the factor has been changed since `read`; otherwise empty."""
        if self._file is None or _state(self._file) == self._seen:
            return ""
        return f"the stored factor was changed while it is in use ({self.path})"


def _state(file: BufferedReader) -> tuple[int, int]:
    """Size [bytes] and time of the last change [ns]."""
    found = os.fstat(file.fileno())
    return found.st_size, found.st_mtime_ns


_LABEL = "factor of an interrupted preparation"


class Checkpoint:
    """Keeps the factor of an object until the object is stored, in a file next to its entry.

    Args:
        path: Path of the object's entry.
    """

    def __init__(self, path: Path) -> None:
        self._path = path.with_name(f"{path.name.removesuffix(SUFFIX)}-factor{SUFFIX}")

    def load(self) -> Factor | None:
        """Load the factor of an interrupted preparation; None if no intact one is stored."""
        arrays = load_entry(self._path, _LABEL, for_all=False)
        if arrays is None:
            return None
        try:
            factor = factor_file.from_arrays(arrays)
        except BodyError as error:
            warn_unusable(_LABEL, error)
            return None
        return factor if factor.fronts[-1].lower.dtype == np.float64 else None

    def save(self, factor: Factor) -> None:
        """Store a factor until `remove` is called."""
        save_entry(self._path, _LABEL, factor_file.to_arrays(factor, np.float64), for_all=False)

    def remove(self) -> None:
        """Delete the factor, since its object has been stored."""
        with contextlib.suppress(OSError):
            self._path.unlink()


# Versions, raised when the form of the arrays or their computation changes. Tetrahedra and parts
# have a version each: fTetWild takes minutes, and does not give the same mesh twice.
_TETS_FORM = 8
_REPAIRED_FORM = 2  # additional version of tetrahedra from surfaces that are repaired
_PARTS_FORM = 6
# Additional version of what was read from files of these kinds, whose readers once gave another
# shape, or took what is now refused: instances, sparse or normalised values, objects in parts,
# groups, meshes that are folded, cells that were left out, pieces.
READERS = {".glb": 2, ".gltf": 2, ".3mf": 2, ".msh": 4, ".vtk": 4, ".vtu": 4}

_FAR = "twin/"  # prefix of the far field's arrays in an entry

Arrays = dict[str, npt.NDArray[Any]]


def is_prepared(source: ObjectFile) -> bool:
    """Whether the file exists and its tetrahedra are in the store."""
    return source.path.is_file() and has_entry(tets_path(source), f"mesh of {source.path.name}")


def load_or_prepare(
    source: ObjectFile, progress: Progress = lambda phase, fraction: None
) -> Prepared:
    """Load the tetrahedra of a file from the store, or prepare and store them.

    Args:
        progress: Called with the phase and the share of it that is done.

    Raises:
        BodyError: The file does not hold an object that can be touched.
    """
    if not source.path.is_file():
        return prepare(source)  # raises the error that says why
    path = tets_path(source)
    label = f"tetrahedra of {source.path.name}"
    arrays = load_entry(path, label, mapped=False)
    if arrays is not None:
        try:
            return _prepared_from(arrays)
        except (KeyError, TypeError, ValueError, BodyError) as error:
            warn_unusable(label, error)
    prepared = prepare(source, progress)
    save_entry(path, label, _prepared_to(prepared))
    return prepared


def load_or_make_parts(
    tets: TetMesh,
    fixed: npt.NDArray[np.bool_],
    settings: SolidSettings,
    progress: Progress,
    accept: Callable[[Plan], None] = lambda plan: None,
    *,
    late: bool = False,
    moduli: Moduli | None = None,
) -> SolidParts:
    """Load the expensive parts of a solid from the store, or make and store them.

    Args:
        tets: Tetrahedra of the object at rest.
        fixed: Whether each vertex is held, shape (n,).
        settings: Material and discretisation.
        progress: Called with the phase and the share of it that is done.
        accept: Called with the plan of factoring before factoring begins; may raise an error.
        late: Whether another process reads and checks a stored factor later. Otherwise the factor
            is read here, and made anew if it is damaged.
        moduli: Moduli of each tetrahedron; None for those of `settings` everywhere.

    Raises:
        BodyError: The fixed vertices leave a rigid motion free, or leave no vertex free.
    """
    if moduli is None:
        moduli = Moduli.uniform(len(tets.tets), settings.young, settings.nu)
    stored, multiple = at_default_young(moduli)
    path = _parts_path(tets, fixed, settings, stored)
    found = _load_parts(path, lambda: shape_of(tets, fixed, settings, moduli), multiple, late=late)
    if found is not None:
        return found
    # If this is interrupted while the surface is pressed, the next start finds the factor.
    factored = Checkpoint(path)
    parts = make_parts(tets, fixed, settings, progress, accept, factored, stored)
    progress("storing", 0.0)
    assert isinstance(parts.factor, Factor)
    factor_arrays = _with_prefix(PREFIX, factor_file.to_arrays(parts.factor))
    save_entry(path, "factor", _with_prefix(_FAR, parts.far_field.to_arrays()) | factor_arrays)
    del factor_arrays
    factored.remove()
    # This process goes on with the stored factor, as later starts do.
    shape = parts.shape if multiple == 1.0 else replace(parts.shape, moduli=moduli)
    found = _load_parts(path, lambda: shape, multiple, late=late)
    if found is not None:
        return found
    return SolidParts(shape, parts.factor.times(multiple), parts.far_field.times(1.0 / multiple))


def at_default_young(moduli: Moduli) -> tuple[Moduli, float]:
    """Return the moduli for which results are stored, and the given stiffness over theirs.

    These are `YOUNG` for an object of one material, and the given moduli for any other.
    """
    if not moduli.is_uniform:
        return moduli, 1.0
    young, nu = float(moduli.young[0]), float(moduli.nu[0])
    return Moduli.uniform(len(moduli.young), YOUNG, nu), young / YOUNG


def _load_parts(
    path: Path, make_shape: Callable[[], SolidShape], multiple: float, *, late: bool
) -> SolidParts | None:
    """Parts of a solid from an entry, `multiple` times as stiff; None if there is no intact one."""
    # Ticks read these arrays. They are copied, so that ticks do not depend on the file.
    far = load_entry(path, "factor", mapped=False, under=_FAR)
    if far is None:
        return None
    try:
        shape, far_field = make_shape(), FarField.from_arrays(far).times(1.0 / multiple)
        if late:
            fronts = load_entry(path, "factor", mapped=False, under=f"{PREFIX}fronts")
            if fronts is None:
                return None
            count = factor_file.stored_bytes(fronts[""])
            return SolidParts(shape, StoredFactor(path, count, multiple), far_field)
        arrays = load_entry(path, "factor", under=PREFIX)
        if arrays is not None:
            return SolidParts(shape, factor_file.from_arrays(arrays).times(multiple), far_field)
    except (KeyError, ValueError, IndexError, BodyError) as error:
        warn_unusable("factor", error)
    return None


def _parts_path(
    tets: TetMesh, fixed: npt.NDArray[np.bool_], settings: SolidSettings, moduli: Moduli
) -> Path:
    """Path of a solid's entry; a uniform material counts by its numbers, not by element."""
    young, nu = settings.young, settings.nu
    more = [moduli.young.tobytes(), moduli.nu.tobytes()]
    if moduli.is_uniform:
        young, nu, more = float(moduli.young[0]), float(moduli.nu[0]), []
    material = (_PARTS_FORM, young, nu, settings.contact_radius, settings.order)
    arrays = (tets.vertices.tobytes(), tets.tets.tobytes(), fixed.tobytes())
    return entry_path(repr(material).encode(), *arrays, *more)


def tets_path(source: ObjectFile) -> Path:
    """Path of the entry with the tetrahedra of an existing file."""
    options = [option.value(source) for option in OPTIONS if option.tets]
    form: tuple[int, ...] = (_TETS_FORM, _REPAIRED_FORM) if source.repair else (_TETS_FORM,)
    kind = source.path.suffix.lower()
    form += (READERS[kind],) if kind in READERS else ()
    key = repr((*form, kind, *options)).encode()
    return entry_path(key, source.path.read_bytes())


def _prepared_to(prepared: Prepared) -> Arrays:
    report = () if prepared.surface is None else astuple(prepared.surface)
    return {
        "vertices": prepared.tets.vertices,
        "tets": prepared.tets.tets,
        "report": np.array(report, dtype=np.float64),
        "triangles": np.array([prepared.triangles, prepared.simplified], dtype=np.int64),
        "deviation": np.array([prepared.deviation]),
        "words": np.frombuffer(json.dumps(prepared.words).encode(), np.uint8),
        **_groups_to(prepared.parts),
    }


def _groups_to(parts: Parts | None) -> Arrays:
    if parts is None:
        return {}
    names = json.dumps(parts.names).encode()
    return {"part of": parts.of, "part names": np.frombuffer(names, np.uint8)}


def _groups_from(arrays: Arrays) -> Parts | None:
    if "part of" not in arrays:
        return None
    return Parts(tuple(json.loads(arrays["part names"].tobytes())), arrays["part of"])


def _prepared_from(arrays: Arrays) -> Prepared:
    tets = TetMesh.checked(arrays["vertices"], arrays["tets"])
    triangles, simplified = arrays["triangles"].tolist()
    (deviation,) = arrays["deviation"].tolist()
    report, parts = _report_from(arrays["report"].tolist()), _groups_from(arrays)
    words = tuple(json.loads(arrays["words"].tobytes()))
    return Prepared(tets, report, triangles, simplified, deviation, parts, words)


def _report_from(values: list[float]) -> SurfaceReport | None:
    if not values:
        return None
    counts = (int(value) for value in values[:4])
    return SurfaceReport(*counts, *values[4:])


def _with_prefix(prefix: str, arrays: Mapping[str, npt.NDArray[Any]]) -> Arrays:
    return {prefix + name: array for name, array in arrays.items()}
