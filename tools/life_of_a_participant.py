"""Writes and draws the table of a participant's life (`cohaptic_server/room/life.py`) for the docs.

python tools/life_of_a_participant.py        # or `make life`
"""

from __future__ import annotations

from html import escape
from pathlib import Path

from cohaptic_server.room.life import LIFE, MESSAGES, Hand, State

ROOT = Path(__file__).parents[1]
PAGE, PICTURE = ROOT / "docs/protocol.md", ROOT / "docs/pictures/life.svg"
BEGIN, END = "<!-- life: written by `make life` -->\n", "<!-- end of the life -->\n"

WIDTH, HEIGHT = 200, 112  # of a box [px]
STEP_X, STEP_Y = 356, 160  # from box to box [px]
# Column and row of each state in the drawing. The end is not drawn: the boxes say what leads to it.
PLACES = {
    State.WATCHING: (2, 0),
    State.OFFERED: (0, 1),
    State.ASKING: (1, 1),
    State.JOINED: (2, 1),
    State.KEPT: (3, 1),
    State.WAITING: (1, 2),
    State.CALLED: (2, 2),
}
STYLE = """\
text { font: 12px system-ui, sans-serif; fill: #222; text-anchor: middle; }
.name { font-weight: 600; font-size: 15px; } .ends { font-size: 11px; fill: #666; }
rect { fill: #e6f2f1; stroke: #00796b; } line { stroke: #555; } marker path { fill: #555; }
@media (prefers-color-scheme: dark) {
  text { fill: #ddd; } .ends { fill: #aaa; } rect { fill: #17322f; stroke: #4db6ac; }
  line { stroke: #aaa; } marker path { fill: #aaa; }
}"""


def ends(state: State) -> list[str]:
    """Return the events that end the life in a state, in words."""
    steps = [step for step in LIFE if state in step.before and step.after is State.GONE]
    return [step.event.value for step in steps]


def centre(state: State) -> tuple[float, float]:
    """Return the middle of a state's box [px]."""
    column, row = PLACES[state]
    return 12 + WIDTH / 2 + column * STEP_X, 12 + HEIGHT / 2 + row * STEP_Y


def edge(before: State, after: State, words: str) -> str:
    """Return an arrow from box to box with its words, as SVG."""
    (x0, y0), (x1, y1) = centre(before), centre(after)
    dx, dy = x1 - x0, y1 - y0
    # Where the line leaves a box: the side that it meets first.
    part = min(WIDTH / 2 / abs(dx) if dx else 1.0, HEIGHT / 2 / abs(dy) if dy else 1.0)
    # Two arrows between the same boxes lie beside each other.
    aside = 14 if dy == 0 and any(s.after is before and after in s.before for s in LIFE) else 0
    aside = -aside if dx > 0 else aside
    ax, ay, bx, by = x0 + part * dx, y0 + part * dy, x1 - part * dx, y1 - part * dy
    # Words stand above a level arrow, and beside the middle of any other.
    mx, my = (ax + bx) / 2, (ay + by) / 2 + aside
    my += (-7 if aside <= 0 else 17) if dy == 0 else 4
    mx += 0 if dy == 0 else 62 if dx == 0 else 56
    return (
        f'<line x1="{ax:g}" y1="{ay + aside:g}" x2="{bx:g}" y2="{by + aside:g}" '
        f'marker-end="url(#tip)"/>\n<text x="{mx:g}" y="{my:g}">{escape(words)}</text>'
    )


def box(state: State) -> str:
    """Return the box of a state, with what ends the life there, as SVG."""
    x, y = centre(state)
    left, top, name = x - WIDTH / 2, y - HEIGHT / 2, state.name.lower()
    lines = [
        f'<rect x="{left:g}" y="{top:g}" width="{WIDTH}" height="{HEIGHT}" rx="8"/>',
        f'<text class="name" x="{x:g}" y="{y - 34:g}">{name}</text>',
    ]
    lines += [
        f'<text class="ends" x="{x:g}" y="{y - 15 + 14 * k:g}">{escape("✕ " + words)}</text>'
        for k, words in enumerate(ends(state))
    ]
    return "\n".join(lines)


def picture() -> str:
    """Return the drawing of the table, as SVG."""
    width, height = 3 * STEP_X + WIDTH + 24, 2 * STEP_Y + HEIGHT + 24
    drawn = [(s.event.value, b, s.after) for s in LIFE for b in s.before if s.after in PLACES]
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
        'aria-label="States of a participant, and the events between them">',
        f"<style>{STYLE}</style>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" '
        'markerHeight="8" orient="auto"><path d="M0 0 8 4 0 8Z"/></marker></defs>',
        *(box(state) for state in PLACES),
        *(edge(before, after, words) for words, before, after in drawn),
        "</svg>\n",
    ]
    return "\n".join(parts)


def table() -> str:
    """Return the tables of the life, as Markdown."""
    lines = ["| state | the participant | may send |", "| --- | --- | --- |"]
    for state in State:
        kinds = MESSAGES.get(state, ())
        may = ", ".join(f"`{_snake(kind.__name__)}`" for kind in kinds) or "nothing"
        if state is State.WATCHING:
            may = "as the messages below say"
        lines.append(f"| {state.name.lower()} | {state.value} | {may} |")
    lines += ["", "| from | event | to | when | decided in |", "| --- | --- | --- | --- | --- |"]
    for step in LIFE:
        before = ", ".join(state.name.lower() for state in step.before)
        after = step.after.name.lower()
        where = ", ".join(
            f"`{module.replace('.', '/')}.py` `{name}`"
            for module, _, name in (one.partition(":") for one in step.where.split())
        )
        lines.append(f"| {before} | {step.event.value} | {after} | {step.rule} | {where} |")
    lines += ["", "| hand of one who touches | its force |", "| --- | --- |"]
    lines += [f"| {hand.name.lower()} | {hand.value} |" for hand in Hand]
    return "\n".join(lines) + "\n"


def _snake(name: str) -> str:
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")


def written(page: str) -> str:
    """Return the page with the tables of today.

    Raises:
        ValueError: The page has lost a mark.
    """
    before, found, rest = page.partition(BEGIN)
    _, end, behind = rest.partition(END)
    if not found or not end:
        raise ValueError(f"{PAGE.name} has lost a mark: {BEGIN.strip()} or {END.strip()}")
    return f"{before}{BEGIN}\n{table()}\n{END}{behind}"


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
