"""What of a solid takes long to make, as a value that can be stored."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic_server.bodies.green_columns import GreenColumns
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.bodies.multifrontal import Factor
from cohaptic_server.bodies.solid import Solid, SolidSettings
from cohaptic_server.bodies.tetrahedra import TetMesh


@dataclass(frozen=True, eq=False)
class CoarseTwin:
    """Stand-in: the table of compliances."""

    table: Floats

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """By name."""
        return {"table": self.table}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> CoarseTwin:
        """Of `to_arrays`."""
        return cls(np.asarray(arrays["table"], dtype=np.float64))


@dataclass(frozen=True, eq=False)
class SolidParts:
    """Factor and twin."""

    factor: Factor
    twin: CoarseTwin


def make_parts(
    tets: TetMesh,
    held: npt.NDArray[np.bool_],
    settings: SolidSettings,
    progress: Callable[[str, float], None],
) -> SolidParts:
    """The long way."""
    progress("factor", 0.0)
    solid = Solid(tets, held, settings)
    progress("survey", 0.0)
    columns: Any = solid.columns
    return SolidParts(columns._factor, CoarseTwin(solid.vertex_compliance()))


class PartedSolid(Solid):
    """Stand-in for `Solid(parts=...)`."""

    def __init__(
        self,
        tets: TetMesh,
        held: npt.NDArray[np.bool_],
        settings: SolidSettings,
        name: str,
        parts: SolidParts,
    ) -> None:
        self.parts = parts
        super().__init__(tets, held, settings, name)

    def _factored(self) -> GreenColumns:
        place = np.full(len(self.nodes), -1, dtype=np.int64)
        free = np.flatnonzero(~self.held)
        place[free] = np.arange(len(free))
        self.factor_bytes = self.parts.factor.bytes
        return GreenColumns(self.parts.factor, place[self.surface], self.settings.cache)

    def vertex_compliance(self) -> Floats:
        """Of the table."""
        return self.parts.twin.table
