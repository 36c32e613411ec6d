"""The body of a demonstration, and hands on it: the balloon's stand round it, others are placed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic.errors import SettingError
from cohaptic_server.bodies.body import Body
from cohaptic_server.demo.places import Standing, stand
from cohaptic_server.demo.scene import Scene
from cohaptic_server.objects.catalogue import BODIES, build_body
from cohaptic_server.objects.fix_rule import fixed_vertices
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.progress import Progress

BALLOON = "balloon"
FIX = "z < 15%"  # of an object, unless the user says otherwise: it stands on its foot


def set_up(
    scene: Scene, name: str, source: ObjectFile, *, nonlinear: bool, progress: Progress
) -> tuple[Body, Scene, str]:
    """Build what is touched, and put the hands on it.

    Args:
        scene: What is wanted.
        name: Of the body, or the path of a file.
        solid: How a file becomes a solid.
        nonlinear: Finite deformation.
        progress: Is told phases and shares.

    Returns:
        The body, the scene with places, and a sentence on them; empty for the balloon.

    Raises:
        BodyError: The file is no object that can be touched, or has no place for so many hands.
        SettingError: An option does not fit the body.
    """
    if name in BODIES and name != BALLOON:
        why = f"{BALLOON} or a file: hands feel nothing of each other on this one"
        raise SettingError("body of the demonstration", repr(name), why)
    if scene.drags and name != BALLOON:
        why = f"{BALLOON}: on no other is it known where one finger drags another"
        raise SettingError("body of the demonstration with friction", repr(name), why)
    body = build_body(name, source, nonlinear=nonlinear, progress=progress)
    if name == BALLOON:
        return body, scene, ""
    progress("places for the hands", 0.0)
    held = fixed_vertices(source, body.mesh.vertices)
    # Beside other work on the same cores two BLAS threads wait for each other.
    with threadpool_limits(limits=1):
        found = stand(body, np.asarray(held), scene.users)
    placed = replace(scene, places=found.places, depth=found.depth)
    return body, placed, told(found, scene.names)


def told(found: Standing, names: tuple[str, ...]) -> str:
    """Where the hands are, and how much they feel of each other."""
    presses = f"{names[0]} presses up to {1e3 * found.depth:.0f} mm deep"
    others = [
        f"{name} is {1e3 * apart:.0f} mm away and {'pushed out' if c < 0.0 else 'sinks in'}"
        f" (C_ij/C_ii {c:+.2f})"
        for name, c, apart in zip(names[1:], found.coupling[1:], found.apart[1:], strict=True)
    ]
    return f"{presses}; {'; '.join(others)}."


def serve_options(name: str, source: ObjectFile, *, nonlinear: bool) -> list[str]:
    """Options with which `cohaptic serve` has the same body."""
    options = ["--body", name, *(["--nonlinear"] if nonlinear else [])]
    if name == BALLOON:
        return options
    return options + source.to_arguments()
