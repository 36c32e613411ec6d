"""The picture of `cohaptic why`: a force over time, and what each rule did to it."""

# pyright: reportUnknownMemberType=false, reportMissingTypeStubs=false

from __future__ import annotations

from cohaptic.cli.output import Output
from cohaptic.errors import SettingError
from cohaptic.recording.why import Columns, stacked

_DRAWING = 'matplotlib, for the picture: pip install "cohaptic[experiments]"'


def draw(picture: Output, columns: Columns, start: float, end: float) -> None:
    """Draw the stack of a span of time.

    Raises:
        SettingError: The span is none, or matplotlib is missing.
    """
    t, entries, force = stacked(columns, start, end)
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise SettingError("--out", picture.path, f"left out, or install {_DRAWING}") from error
    figure = Figure(figsize=(10.0, 6.4), facecolor="white")
    above = figure.add_axes((0.08, 0.56, 0.72, 0.38))
    below = figure.add_axes((0.08, 0.1, 0.72, 0.38), sharex=above)
    above.fill_between(t, entries.pop("surface", 0.0 * t), color="#CBD5E1", label="surface")
    above.plot(t, force, color="#1F2937", linewidth=1.4, label="given")
    above.set_ylabel("force [N]")
    for sign in (1.0, -1.0):  # what adds to the force above zero, what is held back below
        parts = [sign * (sign * values).clip(0.0) for values in entries.values()]
        if parts:
            below.stackplot(t, *parts, labels=list(entries) if sign > 0.0 else (), alpha=0.85)
        below.set_prop_cycle(None)
    below.axhline(0.0, color="#6B7280", linewidth=0.6)
    below.set_ylabel("added or held back, by rule [N]")
    below.set_xlabel("s since the beginning of the recording")
    for axes in (above, below):
        axes.margins(x=0.0)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    picture.write_by(lambda file: figure.savefig(file, format="png", dpi=160))
