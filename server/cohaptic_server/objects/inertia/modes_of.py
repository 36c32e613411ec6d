"""Finds the natural modes of a solid that a hand can excite, and keeps them in the store."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic.clock import SystemClock
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.modal.modal_body import (
    HIGHEST,
    LARGEST,
    ModalBody,
    Modes,
)
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.solid.vibration import natural_modes
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.build import Built
from cohaptic_server.objects.cost import check_memory, cost_of, multiplications
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.cache import entry_path, load_entry, save_entry, warn_unusable
from cohaptic_server.progress import Progress

_FORM = 1  # version of the entry; raised when the arrays or their computation change
_LABEL = "natural modes"


def with_inertia(
    built: Built, source: ObjectFile, hz: float, progress: Progress = lambda phase, fraction: None
) -> Body:
    """Add to a solid its natural modes up to the highest frequency that a hand excites.

    A solid whose slowest mode is above that frequency is returned unchanged, since it follows a
    hand without delay.

    Args:
        source: The file and its options, with a density.
        hz: Ticks per second of the server.
        progress: Called with the phase and the share of it that is done.

    Raises:
        SettingError: A density names an unknown part.
        BodyError: Finding the modes takes more memory than is allowed.
    """
    solid, inertia = built.solid, source.inertia
    density = inertia.of_elements(built.parts, len(solid.shape.tets.tets))
    path = _path(solid, density)
    found = _load(path, len(solid.mesh.vertices))
    if found is None:
        found = _find(built, density, source, lambda fraction: progress(_LABEL, fraction))
        frequency, shapes = found
        save_entry(path, _LABEL, {"frequency": frequency, "shapes": shapes.astype(np.float32)})
    frequency, shapes = found
    slow = int(np.count_nonzero(frequency < 2.0 * math.pi * HIGHEST))
    if not slow:
        return solid
    return ModalBody(solid, Modes(frequency[:slow], shapes[:slow], inertia.damping), 1.0 / hz)


def _find(
    built: Built, density: Floats, source: ObjectFile, progress: Callable[[float], None]
) -> tuple[Floats, Floats]:
    """Find the lowest modes: angular frequencies [rad/s], and shapes on the surface [sqrt(m/N)]."""
    shape = built.solid.shape

    def accept(plan: Plan) -> None:
        what = f"{source.path}: the natural modes of {len(shape.tets.tets):,} tetrahedra"
        edge = None if built.prepared.surface is None else source.edge
        cost = cost_of(plan, multiplications(SystemClock()))
        check_memory(cost, source.max_memory, what, edge, source.material.order)

    # Two BLAS threads wait for each other if other work runs on the same cores.
    with threadpool_limits(limits=1):
        vibration = natural_modes(shape, density, LARGEST, progress, accept)
    on_surface = vibration.shapes[:, shape.surface]
    return vibration.frequency, on_surface / vibration.frequency[:, None, None]


def _path(solid: Solid, density: Floats) -> Path:
    """Path of the entry with the modes of a solid."""
    shape, form = solid.shape, repr((_FORM, LARGEST)).encode()
    arrays = (shape.nodes, shape.elements, shape.fixed, shape.moduli.young, shape.moduli.nu)
    return entry_path(form, *(array.tobytes() for array in arrays), density.tobytes())


def _load(path: Path, vertices: int) -> tuple[Floats, Floats] | None:
    """Frequencies and shapes in an entry; None if there is no intact entry."""
    arrays = load_entry(path, _LABEL, mapped=False)
    if arrays is None:
        return None
    try:
        frequency = np.asarray(arrays["frequency"], dtype=np.float64)
        shapes = np.asarray(arrays["shapes"], dtype=np.float64)
        expected = (len(frequency), vertices, 3)
        if shapes.shape != expected or not (np.isfinite(shapes).all() and (frequency > 0.0).all()):
            raise ValueError(f"shapes {shapes.shape} of {expected}")
    except (KeyError, ValueError) as error:
        warn_unusable(_LABEL, error)
        return None
    return frequency, shapes
