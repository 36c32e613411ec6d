"""Write what is made from the table of frames: the page's layout, that of C++, tables of the docs.

    python tools/generate_protocol.py [--check]

`shared/cohaptic/protocol/layout.py` has the table. With --check nothing is written, and the status
is 1 if a file is not current.
"""

from __future__ import annotations

import argparse
import re
import sys
import textwrap
from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path

from cohaptic.protocol import (
    frame,
    messages,
    neighbourhood,
    patch,
    quantised_mesh,
    rest_mesh,
    scene_users,
)
from cohaptic.protocol.fields import HEAD, Field, FrameKind, Layout
from cohaptic.protocol.layout import (
    ACK,
    ANCHOR,
    CONTACT_SAMPLE,
    DEFLECTION,
    FACE,
    LAYOUTS,
    OWN_MODEL,
    PATCH,
    VERTEX,
)
from cohaptic.protocol.version import FAMILY, PROTOCOL_VERSION

ROOT = Path(__file__).parents[1]
PAGE, DOCS = ROOT / "web/src/protocol/layout.ts", ROOT / "docs/protocol.md"
HEADER = ROOT / "clients/cpp/cohaptic.hpp"
_SENT = (CONTACT_SAMPLE, ANCHOR, DEFLECTION, OWN_MODEL, ACK)  # the page writes these
_BULK = (VERTEX, FACE)  # the page reads these by the thousand, in loops of its own
# Limits of the codecs that the page checks, too, with their units.
_LIMITS: dict[str, tuple[float, str]] = {
    "MAX_POSITION": (frame.MAX_POSITION, "m"),
    "MAX_FORCE": (frame.MAX_FORCE, "N"),
    "MAX_STIFFNESS": (patch.MAX_STIFFNESS, "N/m"),
    "MIN_COMPLIANCE": (patch.MIN_COMPLIANCE, "m/N, of fixed and rigid parts"),
    "MAX_CURVATURE": (patch.MAX_CURVATURE, "1/m, of a patch"),
    "MAX_LAG": (patch.MAX_LAG, "s"),
    "MAX_COUPLING": (patch.MAX_COUPLING, ""),
    "MAX_NEIGHBOURS": (neighbourhood.MAX_VERTICES, ""),
    "MAX_VERTICES": (rest_mesh.MAX_VERTICES, "of a rest mesh"),
    "MAX_FACES": (rest_mesh.MAX_FACES, ""),
    "MAX_MESH_BYTES": (rest_mesh.MAX_BYTES, ""),
    "MESH_STEPS": (quantised_mesh.STEPS, "on each axis of a quantised mesh"),
    "MAX_USERS": (scene_users.MAX_USERS, ""),
    "MAX_GAIN_CUT": (patch.MAX_GAIN_CUT, "N/m, in a tick's ledger"),
    "MAX_USER_CURVATURE": (scene_users.MAX_CURVATURE, "1/m, in a scene"),
    "MAX_LOOP_DELAY": (scene_users.MAX_LOOP_DELAY, "s"),
}
# Those that the client in C++ checks: it reads patches, and writes samples.
_LIMITS_OF_CPP: dict[str, tuple[float, str]] = {
    name: _LIMITS[name]
    for name in (
        "MAX_POSITION", "MAX_FORCE", "MAX_STIFFNESS", "MIN_COMPLIANCE", "MAX_CURVATURE",
        "MAX_LAG", "MAX_COUPLING", "MAX_GAIN_CUT",
    )
} | {
    "MAX_COMPLIANCE": (patch.MAX_COMPLIANCE, "m/N"),
    "MAX_CUT": (3.0 * frame.MAX_FORCE, "N, in a tick's ledger"),
    "MIN_PERIOD": (messages.MIN_PERIOD, "s, of the simulation"),
    "MAX_PERIOD": (messages.MAX_PERIOD, "s"),
    "MAX_FRAME_BYTES": (frame.MAX_MESH_FRAME_BYTES, "of a binary message to who touches"),
    "MAX_TEXT": (messages.MAX_WELCOME_TEXT, "characters of a message to who touches"),
    "MAX_TOKEN": (messages.MAX_TOKEN, "characters"),
}  # fmt: skip
_OF_CPP = (CONTACT_SAMPLE, PATCH)
_CPP_BLOCK = re.compile(r"(// <generated: [^\n]*>\n)(.*?)(// <end of what is generated>\n)", re.S)
_BLOCK = re.compile(r"<!-- generated: (\w+) -->\n(.*?)<!-- end -->", re.S)
_ACCESSORS = {
    "u8": "Uint8", "u16": "Uint16", "u32": "Uint32", "i16": "Int16", "f32": "Float32",
    "f64": "Float64",
}  # fmt: skip


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    check: bool = parser.parse_args().check
    stale = [path for path, text in generated().items() if _text(path) != text]
    for path in stale:
        name = path.relative_to(ROOT)
        print(f"{name} is not current: run make protocol" if check else f"wrote {name}")
        if not check:
            path.write_text(generated()[path], encoding="utf-8")
    sys.exit(1 if check and stale else 0)


def generated() -> dict[Path, str]:
    """The text that each generated file must have."""
    return {
        PAGE: typescript(),
        DOCS: with_tables(_text(DOCS)),
        HEADER: with_constants(_text(HEADER)),
    }


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.exists() else ""


def with_tables(page: str) -> str:
    """The docs with each generated block made anew, and the prose between the blocks as it is.

    Raises:
        ValueError: A block is missing, comes twice or has a name that is no layout's.
    """
    made = {"frames": _overview()} | {layout.name: _table(layout) for layout in LAYOUTS}
    named = [name for name, _ in _BLOCK.findall(page)]
    if sorted(named) != sorted(made) or page.count("<!-- generated: ") != len(made):
        raise ValueError(f"the blocks of {DOCS.name} are {named}, and not once each of {[*made]}")
    return _BLOCK.sub(lambda m: f"<!-- generated: {m[1]} -->\n\n{made[m[1]]}\n<!-- end -->", page)


def with_constants(header: str) -> str:
    """The header of C++ with its generated block made anew, and all else as it is.

    Raises:
        ValueError: The block is missing, or comes twice.
    """
    if len(_CPP_BLOCK.findall(header)) != 1:
        raise ValueError(f"{HEADER.name} has not exactly one generated block")
    return _CPP_BLOCK.sub(lambda m: f"{m[1]}{cpp()}{m[3]}", header)


def cpp() -> str:
    """The constants of the wire in C++: version, limits, kinds, and where the fields begin."""
    limits = "".join(
        f"constexpr double {name} = {value:.15g};{f'  // {unit}' if unit else ''}\n"
        for name, (value, unit) in _LIMITS_OF_CPP.items()
    )
    parts = "".join(f"\n{_namespace(layout)}" for layout in _OF_CPP)
    shapes = ", ".join(f"{shape.name.title()} = {shape.value}" for shape in patch.Geometry)
    laws = ", ".join(f"{law.name.title()} = {n}" for n, law in enumerate(patch.LAWS, 1))
    return f"""\
constexpr int PROTOCOL_VERSION = {PROTOCOL_VERSION};
constexpr const char *SUBPROTOCOL = "{FAMILY}{PROTOCOL_VERSION}";
constexpr std::size_t HEAD_SIZE = {HEAD.size};
enum class Geometry : unsigned {{ {shapes} }};
enum class Law : unsigned {{ {laws} }};
{limits}{parts}"""


def _namespace(layout: Layout) -> str:
    """A namespace with the kind and size of a frame, and the offset of each of its fields."""
    assert layout.frame is not None
    lines = [
        f"constexpr unsigned KIND = {layout.frame.kind.value};",
        f"constexpr std::size_t SIZE = {layout.size};",
        *(
            f"constexpr std::size_t {field.name} = {at};  // {_type(field)}"
            + (f" [{field.unit}]" if field.unit else "")
            for at, field in _named(layout)
        ),
    ]
    body = "".join(f"{line}\n" for line in lines)
    name = f"namespace at_{layout.name}"
    return f"// {layout.meaning}\n{name} {{\n{body}}}  // {name}\n"


def _overview() -> str:
    rows = [["name", "kind", "direction", "bytes", "meaning"]]
    for layout in LAYOUTS:
        kind = "" if layout.frame is None else str(layout.frame.kind.value)
        direction = "" if layout.frame is None else layout.frame.direction
        rows.append([f"`{layout.name}`", kind, direction, str(layout.size), layout.meaning])
    return _rows(rows)


def _table(layout: Layout) -> str:
    rows = [["offset", "type", "field", "unit", "meaning", "limit"]]
    head = {}
    if layout.frame is not None:
        flags = (layout.frame.flags, layout.frame.limit)
        version, kind = str(PROTOCOL_VERSION), str(layout.frame.kind.value)
        head = {"version": (version, ""), "kind": (kind, ""), "flags": flags}
    for offset, field in zip(layout.offsets, layout.all_fields, strict=True):
        in_head = field in HEAD.fields
        meaning, limit = head[field.name] if in_head else (field.meaning, field.limit)
        name = field.name if in_head or field.type == "pad" else f"`{field.name}`"
        rows.append([str(offset), _type(field), name, field.unit, meaning, limit])
    return _rows(rows)


def _type(field: Field) -> str:
    kind = "u8" if field.type == "pad" else field.type
    return kind if field.numbers == 1 else f"{field.numbers} {kind}"


def _rows(rows: list[list[str]]) -> str:
    lines = ["|" + "".join(f" {cell} |" if cell else " |" for cell in row) for row in rows]
    lines.insert(1, "|" + " --- |" * len(rows[0]))
    return "".join(f"{line}\n" for line in lines)


def typescript() -> str:
    """The page's module: kinds, sizes, offsets, and what reads and writes the fields."""
    limits = "".join(
        f"export const {name} = {value:.15g};{f' // {unit}' if unit else ''}\n"
        for name, (value, unit) in _LIMITS.items()
    )
    kinds = ", ".join(f"{kind.name.lower()}: {kind.value}" for kind in FrameKind)
    return f"""\
// Made by `make protocol` from shared/cohaptic/protocol/layout.py: change that table instead.

/**
 * The layout of every binary frame and of its parts: sizes, offsets of fields from the beginning,
 * and functions that read and write the fields; the values are not checked.
 */

import type {{ Vec3 }} from "../model/vec";
import {{ getFloat16, getVec, setVec }} from "./numbers";

export const PROTOCOL_VERSION = {PROTOCOL_VERSION};
export const SUBPROTOCOL = "{FAMILY}{PROTOCOL_VERSION}";

/** Second byte of every binary frame. */
export const Kind = {{ {kinds} }} as const;
export const HEAD_SIZE = {HEAD.size};

{limits}""" + "".join(f"\n{part}" for layout in LAYOUTS for part in _parts(layout))


def _parts(layout: Layout) -> Iterator[str]:
    """What the module has of one layout, each with a line break at its end."""
    upper, title = layout.name.upper(), layout.name.title().replace("_", "")
    size = f"export const {upper}_SIZE = {layout.size};\n"
    if layout in _BULK:
        yield size
    elif [field.name for field in layout.fields] == [layout.name]:
        yield size
        yield from _functions_of_one(layout, title, layout.fields[0])
    else:
        offsets = ", ".join(f"{field.name}: {at}" for at, field in _named(layout))
        yield f"{size}export const {upper}_AT = {{ {offsets} }} as const;\n"
        yield from _functions(layout, title)


def _named(layout: Layout) -> list[tuple[int, Field]]:
    """Offsets and fields, without the header and without padding."""
    return [
        (at, field)
        for at, field in zip(layout.offsets, layout.all_fields, strict=True)
        if field.type != "pad" and field not in HEAD.fields
    ]


def _functions_of_one(layout: Layout, title: str, field: Field) -> Iterator[str]:
    """Functions for a part whose only field has its name, and is its value."""
    value = _type_script(field)
    yield (
        f"/** {layout.meaning.rstrip('.')}: {_about(field)} */\n"
        f"export function read{title}(view: DataView, at: number): {value} {{\n"
        f"  return {_get(0, field, part=True)};\n}}\n"
    )
    if layout in _SENT:
        yield (
            f"export function write{title}(view: DataView, at: number, {field.name}: {value}): "
            f"void {{\n  {_set(0, field, field.name, part=True)};\n}}\n"
        )


def _functions(layout: Layout, title: str) -> Iterator[str]:
    """The interface of all fields, and functions that read and write them."""
    part, named = layout.frame is None, _named(layout)
    place = ", at: number" if part else ""
    members = _grouped(
        named,
        "  readonly {}: {{\n",
        "  };\n",
        lambda _, field: f"/** {_about(field)} */ readonly {field.name}: {_type_script(field)};",
    )
    yield f"/** {layout.meaning} */\nexport interface {title}Fields {{\n{members}}}\n"
    if layout is not ACK:
        values = _grouped(
            named,
            "  {}: {{\n",
            "  },\n",
            lambda at, field: f"{field.name}: {_get(at, field, part=part)},",
        )
        yield (
            f"export function read{title}Fields(view: DataView{place}): {title}Fields {{\n"
            f"  return {{\n{textwrap.indent(values, '  ')}  }};\n}}\n"
        )
    if layout in _SENT:
        lines = [
            f"  {_set(at, field, f'fields.{field.name}', part=part)};\n" for at, field in named
        ]
        yield (
            f"export function write{title}Fields(view: DataView{place}, fields: {title}Fields): "
            f"void {{\n{''.join(lines)}}}\n"
        )


def _grouped(
    named: list[tuple[int, Field]],
    begin: str,
    end: str,
    line: Callable[[int, Field], str],
) -> str:
    """A line for each field; fields of one group stand together in an object of its name."""
    text = ""
    for group, members in groupby(named, lambda one: one[1].group):
        lines = "".join(f"  {line(at, field)}\n" for at, field in members)
        text += begin.format(group) + textwrap.indent(lines, "  ") + end if group else lines
    return text


def _about(field: Field) -> str:
    unit = f" [{field.unit.strip('`')}]" if field.unit and _fraction(field) is None else ""
    limit = f"; {field.limit}" if field.limit else ""
    return field.meaning.replace("\\|", "|") + unit + limit


def _fraction(field: Field) -> str | None:
    """The whole number that makes 1, for a field whose unit is a share of 1."""
    fraction = field.unit.removeprefix("1/")
    return fraction if fraction.isdigit() and fraction != field.unit else None


def _type_script(field: Field) -> str:
    if field.numbers == 1:
        return "number"
    return "Vec3" if field.numbers == 3 else f"readonly [{', '.join(['number'] * field.numbers)}]"


def _get(offset: int, field: Field, *, part: bool) -> str:
    """An expression for the value of a field, divided where its unit is a share of 1."""
    places = [_place(at, part) for at in range(offset, offset + field.size, field.step)]
    if field.type == "f32" and field.numbers % 3 == 0:
        vectors = [f"getVec(view, {place})" for place in places[::3]]
        return vectors[0] if len(vectors) == 1 else f"[...{', ...'.join(vectors)}]"
    order = "" if field.type == "u8" else ", true"
    scale = "" if _fraction(field) is None else f" / {_fraction(field)}"
    numbers = [
        f"getFloat16(view, {place}){scale}"
        if field.type == "f16"
        else f"view.get{_ACCESSORS[field.type]}({place}{order}){scale}"
        for place in places
    ]
    return numbers[0] if field.numbers == 1 else f"[{', '.join(numbers)}]"


def _set(offset: int, field: Field, value: str, *, part: bool) -> str:
    """A call that writes the value of a field: of one number, or of a vector."""
    place = _place(offset, part)
    if (field.numbers, field.type) == (3, "f32"):
        return f"setVec(view, {place}, {value})"
    if field.numbers > 1 or _fraction(field) is not None:
        raise ValueError(f"the page cannot write {field.name}, {_type(field)}")
    order = "" if field.type == "u8" else ", true"
    return f"view.set{_ACCESSORS[field.type]}({place}, {value}{order})"


def _place(offset: int, part: bool) -> str:
    if not part:
        return str(offset)
    return f"at + {offset}" if offset else "at"


if __name__ == "__main__":
    main()
