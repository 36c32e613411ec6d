"""The rule that says which part of an object is held: `--fix "z < 10%"`.

    rule        := condition { "and" condition } { "or" ... }
    condition   := axis ("<" | "<=" | ">" | ">=") value
    axis        := "x" | "y" | "z"
    value       := number [ "%" | "m" | "cm" | "mm" ]

A share runs from 0% at the lowest to 100% at the highest place of the object on that axis; lengths
are coordinates of the object as it was scaled. "and" binds before "or".
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from cohaptic.errors import SettingError
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.fix_mesh import held_within
from cohaptic_server.objects.object_file import ObjectFile

GRAMMAR = 'like "z < 10%", "z < 10% or z > 90%", "x >= 2cm and y < 0.01m"'

_CONDITION = re.compile(
    r"\s*([xyz])\s*(<=|>=|<|>)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(%|mm|cm|m)?\s*",
    re.IGNORECASE,
)
_UNITS = {"m": 1.0, "": 1.0, "cm": 0.01, "mm": 0.001}


def held_in(wanted: ObjectFile, x: Floats) -> npt.NDArray[np.bool_]:
    """Which places of an object are held, shape (n,).

    Args:
        wanted: The object, with its rule or its second surface.
        x: Vertices that reach to the ends of the object, shape (n, 3) [m].

    Raises:
        SettingError: Nothing is said, or nothing or everything would be held.
        BodyError: The second surface cannot be read, or is not closed.
    """
    check_said(wanted)
    if wanted.fix_mesh is None:
        return held_by(wanted.fix, x)
    return held_within(wanted.fix_mesh, wanted.scale, x)


def check_said(wanted: ObjectFile) -> None:
    """Refuse an object of which nothing is held, or twice, before anything of it is read."""
    if wanted.fix_mesh is None and not wanted.fix.strip():
        what = 'a rule, or the object floats away: "z < 10%"'
        raise SettingError("--fix", "not given", what)
    if wanted.fix_mesh is not None and wanted.fix.strip():
        raise SettingError("--fix-mesh", str(wanted.fix_mesh), "given without --fix")


def held_by(rule: str, x: Floats) -> npt.NDArray[np.bool_]:
    """Which vertices a rule holds, shape (n,).

    Args:
        rule: As the user wrote it.
        x: Vertices, shape (n, 3) [m].

    Raises:
        SettingError: The rule cannot be read, or holds nothing or everything.
    """
    held = np.zeros(len(x), dtype=np.bool_)
    for part in re.split(r"\bor\b", rule, flags=re.IGNORECASE):
        within = np.ones(len(x), dtype=np.bool_)
        for text in re.split(r"\band\b", part, flags=re.IGNORECASE):
            within &= _holds(text, rule, x)
        held |= within
    if not held.any():
        ranges = ", ".join(
            f"{axis} from {x[:, k].min():.4g} to {x[:, k].max():.4g} m"
            for k, axis in enumerate("xyz")
        )
        what = f"a rule that holds some of the object, or it would float away; it has {ranges}"
        raise SettingError("--fix", repr(rule), what)
    if held.all():
        raise SettingError("--fix", repr(rule), "a rule that leaves something free to move")
    return held


def _holds(text: str, rule: str, x: Floats) -> npt.NDArray[np.bool_]:
    match = _CONDITION.fullmatch(text)
    if match is None:
        where = f" (at {text.strip()!r})" if text.strip() != rule.strip() else ""
        raise SettingError("--fix", repr(rule) + where, GRAMMAR)
    axis, sign, number, unit = match.group(1).lower(), *match.groups()[1:3], match.group(4) or ""
    along = x[:, "xyz".index(axis)]
    if unit == "%":
        if not 0.0 <= float(number) <= 100.0:
            raise SettingError("--fix", repr(rule), "with shares from 0% to 100%")
        limit = along.min() + 0.01 * float(number) * np.ptp(along)
    else:
        limit = float(number) * _UNITS[unit.lower()]
    if sign == "<":
        return np.asarray(along < limit)
    if sign == "<=":
        return np.asarray(along <= limit)
    return np.asarray(along > limit) if sign == ">" else np.asarray(along >= limit)
