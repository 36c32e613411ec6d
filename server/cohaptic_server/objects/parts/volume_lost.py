"""Limits of the volume and shape that filling may lose, and the error if it loses more."""

from __future__ import annotations

from cohaptic.errors import BodyError

MAX_VOLUME_LOSS = 0.2  # share of the volume that tetrahedra may miss
# Largest distance from a surface to that of its tetrahedra, beyond the envelope of the filling, as
# a share of the diagonal. Simplifying takes up to a hundredth. The volume alone proves little: of a
# leaflet 1 mm thick fTetWild made a lump of 25 tetrahedra with 98 % of its volume.
MAX_AWAY = 0.03


class VolumeLostError(BodyError):
    """The tetrahedra miss much of the volume inside a surface, of the whole object or of a part.

    Args:
        problem: The fault, as the beginning of a sentence.
        advice: The rest of the sentence: the reason and the remedy.
        part: Name of the part; empty for the whole object.
        path: Path of the file, if it is known.

    Attributes:
        problem: The fault, as the beginning of a sentence.
        part: Name of the part; empty for the whole object.
    """

    def __init__(self, problem: str, advice: str = "", part: str = "", path: object = None) -> None:
        super().__init__(f"{'' if path is None else f'{path}: '}{problem}{advice}")
        self.problem = problem
        self.part = part
        self._advice = advice

    def of(self, path: object) -> VolumeLostError:
        """Copy of this error whose text begins with the path of the file."""
        return VolumeLostError(self.problem, self._advice, self.part, path)
