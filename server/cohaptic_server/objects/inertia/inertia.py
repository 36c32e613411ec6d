"""Density and modal damping of an object, as the user gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.bodies.modal.modal_body import check_damping_ratio
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.option import Named
from cohaptic_server.objects.parts.materials import check_names
from cohaptic_server.objects.parts.parts import Parts
from cohaptic_server.touchable import DAMPING_RATIO

WATER = 1000.0  # kg/m^3; soft tissue and gels are within a tenth of it
_LEAST, _LARGEST = 1.0, 30000.0  # kg/m^3; foam has 10, the densest metals 22,600


@dataclass(frozen=True, slots=True)
class Inertia:
    """Density of an object, and damping of its natural modes.

    Args:
        density: Mass density of the parts that `densities` does not name [kg/m^3]. None stands for
            the density of water, or for an object without mass if `densities` is empty.
        densities: Densities of parts by their names [kg/m^3].
        damping: Share of critical damping of each natural mode.

    Raises:
        SettingError: A value is out of its range.
    """

    density: float | None = None
    densities: Named = ()
    damping: float = DAMPING_RATIO

    def __post_init__(self) -> None:
        for value in (self.whole, *(value for _, value in self.densities)):
            if not _LEAST <= value <= _LARGEST:
                limits = f"from {_LEAST:g} to {_LARGEST:g} kg/m3"
                raise SettingError("--density", f"{value:g} kg/m3", limits)
        check_damping_ratio(self.damping)

    @property
    def given(self) -> bool:
        """Whether any density is given, so that the object has mass."""
        return self.density is not None or bool(self.densities)

    @property
    def whole(self) -> float:
        """Density of the parts that `densities` does not name [kg/m^3]."""
        return WATER if self.density is None else self.density

    def of_elements(self, parts: Parts | None, count: int) -> Floats:
        """Density of each tetrahedron, shape (count,) [kg/m^3].

        Args:
            parts: Parts of the tetrahedra; None for an object without parts.
            count: Number of tetrahedra.

        Raises:
            SettingError: A density names an unknown part.
        """
        names = () if parts is None else parts.names
        check_names("--density", self.densities, names)
        if parts is None:
            return np.full(count, self.whole)
        known = dict(self.densities)
        return np.array([known.get(name, self.whole) for name in names])[parts.of]
