"""Selects the fixed vertices of an object by a rule: `--fix "z < 10%"`.

    rule        := condition { "and" condition } { "or" ... }
    condition   := axis ("<" | "<=" | ">" | ">=") value
    axis        := "x" | "y" | "z"
    value       := number [ "%" | "m" | "cm" | "mm" ]

A value in % is a share of the object's extent along the axis, from 0% at the lowest coordinate to
100% at the highest; a length is a coordinate of the scaled object. "and" binds tighter than "or".
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from cohaptic.errors import SettingError
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.fix_mesh import fixed_within, inside, read_fix_mesh
from cohaptic_server.objects.held_region import Cut, cut_at
from cohaptic_server.objects.object_file import ObjectFile

GRAMMAR = 'like "z < 10%", "z < 10% or z > 90%", "x >= 2cm and y < 0.01m"'

_CONDITION = re.compile(
    r"\s*([xyz])\s*(<=|>=|<|>)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(%|mm|cm|m)?\s*",
    re.IGNORECASE,
)
_UNITS = {"m": 1.0, "": 1.0, "cm": 0.01, "mm": 0.001}


def fixed_vertices(source: ObjectFile, x: Floats) -> npt.NDArray[np.bool_]:
    """Whether each vertex of an object is fixed, shape (n,).

    Args:
        source: File with a rule in `fix`, or a surface in `fix_mesh`.
        x: Vertices that span the object's bounding box, shape (n, 3) [m].

    Raises:
        SettingError: Not exactly one of the two is given, or nothing or everything is fixed.
        BodyError: The surface of `fix_mesh` cannot be read, or is not closed.
    """
    check_fix_given(source)
    if source.fix_mesh is None:
        return fixed_by_rule(source.fix, x)
    return fixed_within(source.fix_mesh, *read_fix_mesh(source.fix_mesh, source.scale), x)


def hold(source: ObjectFile, tets: TetMesh) -> Cut:
    """Cut an object where its held region ends.

    Args:
        source: File with a rule in `fix`, or a surface in `fix_mesh`.
        tets: Tetrahedra of the object.

    Raises:
        SettingError: Not exactly one of the two is given, or nothing or everything is fixed.
        BodyError: The surface of `fix_mesh` cannot be read, or is not closed.
    """
    check_fix_given(source)
    x = tets.vertices
    if source.fix_mesh is None:
        fixed = fixed_by_rule(source.fix, x)
        return cut_at(tets, fixed, lambda points: _by_rule(source.fix, x, points))
    y, faces = read_fix_mesh(source.fix_mesh, source.scale)
    fixed = fixed_within(source.fix_mesh, y, faces, x)
    return cut_at(tets, fixed, lambda points: inside(y, faces, points))


def check_fix_given(source: ObjectFile) -> None:
    """Check that exactly one of --fix and --fix-mesh is given, before any file is read.

    Raises:
        SettingError: Neither of the two options is given, or both are.
    """
    if source.fix_mesh is None and not source.fix.strip():
        expected = 'a rule, or the object floats away: "z < 10%"'
        raise SettingError("--fix", "not given", expected)
    if source.fix_mesh is not None and source.fix.strip():
        raise SettingError("--fix-mesh", str(source.fix_mesh), "given without --fix")


def fixed_by_rule(rule: str, x: Floats) -> npt.NDArray[np.bool_]:
    """Whether a rule fixes each vertex, shape (n,).

    Args:
        rule: The rule, as the user wrote it.
        x: Vertices, shape (n, 3) [m].

    Raises:
        SettingError: The rule cannot be parsed, or fixes nothing or everything.
    """
    fixed = _by_rule(rule, x, x)
    if not fixed.any():
        ranges = ", ".join(
            f"{axis} from {x[:, k].min():.4g} to {x[:, k].max():.4g} m"
            for k, axis in enumerate("xyz")
        )
        expected = f"a rule that holds some of the object, or it would float away; it has {ranges}"
        raise SettingError("--fix", repr(rule), expected)
    if fixed.all():
        raise SettingError("--fix", repr(rule), "a rule that leaves something free to move")
    return fixed


def _by_rule(rule: str, x: Floats, points: Floats) -> npt.NDArray[np.bool_]:
    """Whether a rule holds each point, shape (n,); percentages refer to the extent of x."""
    fixed = np.zeros(len(points), dtype=np.bool_)
    for part in re.split(r"\bor\b", rule, flags=re.IGNORECASE):
        within = np.ones(len(points), dtype=np.bool_)
        for text in re.split(r"\band\b", part, flags=re.IGNORECASE):
            within &= _satisfied(text, rule, x, points)
        fixed |= within
    return fixed


def _satisfied(text: str, rule: str, x: Floats, points: Floats) -> npt.NDArray[np.bool_]:
    match = _CONDITION.fullmatch(text)
    if match is None:
        where = f" (at {text.strip()!r})" if text.strip() != rule.strip() else ""
        raise SettingError("--fix", repr(rule) + where, GRAMMAR)
    axis, sign, number, unit = match.group(1).lower(), *match.groups()[1:3], match.group(4) or ""
    along = x[:, "xyz".index(axis)]
    at = points[:, "xyz".index(axis)]
    if unit == "%":
        if not 0.0 <= float(number) <= 100.0:
            raise SettingError("--fix", repr(rule), "with shares from 0% to 100%")
        limit = along.min() + 0.01 * float(number) * np.ptp(along)
    else:
        limit = float(number) * _UNITS[unit.lower()]
    if sign == "<":
        return np.asarray(at < limit)
    if sign == "<=":
        return np.asarray(at <= limit)
    return np.asarray(at > limit) if sign == ">" else np.asarray(at >= limit)
