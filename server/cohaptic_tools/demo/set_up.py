"""Builds the body of a demonstration and places the hands on it."""

from __future__ import annotations

from dataclasses import replace

from threadpoolctl import threadpool_limits

from cohaptic.errors import SettingError
from cohaptic_server.bodies.body import Body, elastic_of
from cohaptic_server.bodies.solid.shape import Shaped
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.objects.cost import Demand
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.progress import Progress
from cohaptic_server.touchable import BALLOON, names
from cohaptic_tools.demo.felt import FELT, LEAST_PRESS, MAX_PRESS
from cohaptic_tools.demo.places import place_hands
from cohaptic_tools.demo.scene import Scene
from cohaptic_tools.demo.settled import Placement

FIX = "z < 15%"  # default held region of an object: its foot


def check_body(scene: Scene, name: str) -> None:
    """Check that a scene can be performed on a body, before any file is read.

    Args:
        name: Name of the body, or path of a file.

    Raises:
        SettingError: The scene cannot be performed on the body.
    """
    if name in names() and name != BALLOON:
        why = f"{BALLOON} or a file: on this one no places for the hands are known"
        raise SettingError("body of the demonstration", repr(name), why)
    if scene.drags and name != BALLOON:
        why = f"{BALLOON}: on no other is it known where one finger drags another"
        raise SettingError("body of the demonstration with friction", repr(name), why)


def set_up(
    scene: Scene, name: str, source: ObjectFile, *, nonlinear: bool, progress: Progress
) -> tuple[Body, Scene, str]:
    """Build the body, and choose places for the hands on it.

    The hands stand evenly around the balloon; on other bodies places are searched for.

    Args:
        scene: Scene in which the places of the hands are not chosen yet.
        name: Name of the body, or path of a file.
        source: File of the object, and its options.
        nonlinear: Whether the body is nonlinear (finite deformation).
        progress: Called with the name of each phase and the finished fraction of it, 0 to 1.

    Returns:
        The body, the scene with places, and a sentence on the places; for the balloon the scene is
        unchanged and the sentence empty.

    Raises:
        BodyError: The file contains no object that can be touched, or there are no places for all
            hands.
        SettingError: An option does not fit the body.
    """
    check_body(scene, name)
    demand = Demand(scene.users, scene.simulation_hz, nonlinear)
    body = build_body(
        name,
        source,
        nonlinear=nonlinear,
        hz=scene.simulation_hz,
        demand=demand,
        progress=progress,
    )
    if name == BALLOON:
        return body, scene, ""
    progress("places for the hands", 0.0)
    elastic = elastic_of(body)
    assert isinstance(elastic, Shaped)  # true for all bodies from files
    # With other work on the same cores, two BLAS threads would wait for each other.
    with threadpool_limits(limits=1):
        placement = place_hands(
            elastic,
            elastic.shape.held,
            scene.users,
            lambda fraction: progress("places for the hands", fraction),
        )
    origin = elastic.mesh.origin
    scene = replace(scene, places=placement.places, depth=placement.depth, origin=origin)
    # The elastic body is returned without its mass, since an equilibrium does not depend on mass.
    return elastic, scene, describe_placement(placement, scene.names)


def describe_placement(placement: Placement, names: tuple[str, ...]) -> str:
    """Return sentences with the places of the hands, the coupling between them, and the forces."""
    presses = f"{names[0]} presses up to {1e3 * placement.depth:.0f} mm deep"
    others = [
        f"{name} is {1e3 * distance:.0f} mm away and {'pushed out' if c < 0.0 else 'sinks in'}"
        f" (C_ij/C_ii {c:+.2f})"
        for name, c, distance in zip(
            names[1:], placement.coupling[1:], placement.distances[1:], strict=True
        )
    ]
    return f"{presses}; {'; '.join(others)}. {_felt_words(placement, names)}"


def _felt_words(placement: Placement, names: tuple[str, ...]) -> str:
    """Return a sentence with the forces of the first two hands, and advice where it is too weak."""
    pair, (left, right) = placement.pair, names[:2]
    forces = (
        f"{left} presses with {pair.force[0]:.2g} N and feels {pair.felt[0]:.2g} N of {right};"
        f" {right} presses with {pair.force[1]:.2g} N and feels {pair.felt[1]:.2g} N of {left}"
    )
    if pair.is_felt:
        return f"{forces[0].upper()}{forces[1:]}."
    best = f"the best: {forces}" if pair.force.any() else "hands slide off those that were tried"
    return (
        "No two places were found at which hands press with"
        f" {LEAST_PRESS:g} to {MAX_PRESS:g} N and feel {FELT:g} N of each other; {best}."
        " Hold another part of it (--fix), or take another softness (--young)."
    )


def serve_options(name: str, source: ObjectFile, *, nonlinear: bool, users: int = 2) -> list[str]:
    """Return the options with which `cohaptic serve` simulates the same body."""
    options = ["--body", name, *(["--nonlinear"] if nonlinear else [])]
    if name == BALLOON:
        return options
    if nonlinear:
        options += ["--users", str(users)]  # so that the server chooses the same mesh
    return options + source.to_arguments()
