"""The tetrahedra in an object may miss a little of it, and no more."""

from __future__ import annotations

from cohaptic.errors import BodyError

MAX_VOLUME_LOSS = 0.2  # share of the volume that tetrahedra may miss
# Farthest that a surface may be from that of its tetrahedra, beyond the envelope in which these are
# made, as a share of the diagonal. Simplifying takes up to a hundredth. The volume alone does not
# tell: fTetWild made of a leaflet, 1 mm thick, a lump of 25 tetrahedra with 98 % of its volume.
MAX_AWAY = 0.03


class VolumeLostError(BodyError):
    """The tetrahedra miss much of what a surface encloses, of the whole object or of a part.

    Args:
        problem: What is wrong, as the beginning of a sentence.
        advice: The rest of it: why, and what to do.
        part: Name of the part; empty for the object.
        path: Path of the file, if it is known.

    Attributes:
        problem: As given.
        part: As given.
    """

    def __init__(self, problem: str, advice: str = "", part: str = "", path: object = None) -> None:
        super().__init__(f"{'' if path is None else f'{path}: '}{problem}{advice}")
        self.problem = problem
        self.part = part
        self._advice = advice

    def of(self, path: object) -> VolumeLostError:
        """The same with the path of the file before its words."""
        return VolumeLostError(self.problem, self._advice, self.part, path)
