"""How far fTetWild is, from what it prints: its phases, and the passes of its optimisation.

How many passes it will make is not known, since it stops when its worst element is good enough:
4 on a torus of 3,000 triangles, 10 on a noisy scan of 60,000. Each pass therefore takes the same
share of what is left, and the share of the whole never goes back.
"""

from __future__ import annotations

# Shares of the time of a scan of 60,000 triangles at the end of each phase, in the order of their
# lines; a clean surface of 3,000 differs by 0.1.
_PHASES = (
    ("collapsing ", 0.09),  # the surface was simplified within the envelope
    ("triangle insertion start", 0.1),
    ("mark_surface_fs done", 0.15),
    ("initializing...", 0.16),
    ("edge collapsing done!", 0.2),
)
_OPTIMISED = 0.2  # share at which the passes begin
_POST = 0.93  # at which they are over
_PASS = 0.18  # share of what is left of the passes that each takes
# Shares of a pass at the end of its four steps.
_STEPS = {"edge splitting": 0.02, "edge collapsing": 0.5, "edge swapping": 0.65}
_COMPLETED = 0.98


class FillLog:
    """Reads the lines of one run of fTetWild.

    Attributes:
        share: Of the time of the run, roughly; from 0 to 1, never falling.
        passes: Passes of the optimisation that were begun.
    """

    def __init__(self) -> None:
        self.share, self.passes = 0.0, 0
        self._post = False

    def read(self, line: str) -> float:
        """The share after a line."""
        self.share = max(self.share, self._share(line))
        return self.share

    def _share(self, line: str) -> float:
        if "//// pass " in line:
            self.passes += 1
            return self._at_pass(0.0)
        if "postprocessing" in line:
            self._post = True
            return _POST
        if "Tetrahedralization completed" in line:
            return _COMPLETED
        if self._post:
            return 0.0
        if self.passes:
            step = line.removesuffix(" done!") if line.endswith(" done!") else ""
            return self._at_pass(_STEPS[step]) if step in _STEPS else 0.0
        return max((share for mark, share in _PHASES if mark in line), default=0.0)

    def _at_pass(self, done: float) -> float:
        left: float = (1.0 - _PASS) ** (self.passes - 1 + done)
        return _OPTIMISED + (_POST - _OPTIMISED) * (1.0 - left)
