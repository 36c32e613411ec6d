"""One body for each law of `check_body` that breaks this law, and no law that is checked before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import Body, DenseResponse, Load, Response
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.numeric import Floats, Ints

Change = Callable[[DenseResponse, Sequence[Load], Response | None], DenseResponse]

BALLOON = Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))
INWARD = np.array([-1.0, 0.0, 0.0])


class Changed:
    """The linear balloon with an altered response."""

    name = "changed"
    linear = True

    def __init__(self, change: Change, body: Balloon = BALLOON) -> None:
        self.body, self.change = body, change
        self.mesh, self.contact_radius = body.mesh, body.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        return self.change(self.body.respond(loads, before), loads, before)


class Plate(Spring):
    """The plate with another law of motion.

    Args:
        move: Next depth from the total force, the depth before and the stiffness.
        fraction: Reported compliance over that of the spring.
    """

    def __init__(self, move: Callable[[float, float, float], float], fraction: float = 1.0) -> None:
        super().__init__()
        self.move, self.fraction = move, fraction

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        k = self.settings.k_o
        previous = 0.0 if before is None else float(before.displacement[0] @ INWARD)
        x = self.move(sum(load.force for load in loads), previous, k)
        u = x * np.broadcast_to(INWARD, self.mesh.vertices.shape)
        unit = np.broadcast_to(INWARD / k, (len(loads), *u.shape))
        C = np.full((len(loads), len(loads)), self.fraction / k)
        return DenseResponse(u, unit, C, 0.5 * k * x * x)


def shifted(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    del loads, before
    return replace(r, displacement=r.displacement + 1e-3)


class Forgetful(Changed):
    """Each answer is a little larger than the last."""

    calls = 0

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        self.calls += 1
        r = self.body.respond(loads, before)
        return replace(r, displacement=r.displacement * (1.0 + 0.01 * self.calls))


def first_counts_more(
    r: DenseResponse, loads: Sequence[Load], before: Response | None
) -> DenseResponse:
    del before
    if not loads:
        return r
    return replace(r, displacement=r.displacement + 0.1 * loads[0].force * r.fields[0])


def outward(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    del loads, before
    return replace(r, displacement=-r.displacement)


def _bias(loads: Sequence[Load]) -> Floats:
    """A number for each contact, by the direction of its force."""
    return np.array([load.direction @ (0.5, 0.3, 0.2) for load in loads])


def asymmetric(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    del before
    return replace(r, compliance=r.compliance * (1.0 + 0.1 * _bias(loads))[:, None])


def one_way(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    """Some contacts move the body more, and are moved as before."""
    del before
    fractions = [(1.0 + 0.3 * h) * one.force for h, one in zip(_bias(loads), loads, strict=True)]
    u = np.tensordot(np.array(fractions), r.fields, axes=1) if loads else r.displacement
    return replace(r, displacement=u)


def more_than_the_sum(
    r: DenseResponse, loads: Sequence[Load], before: Response | None
) -> DenseResponse:
    del before
    count = sum(load.force != 0.0 for load in loads)
    return replace(r, displacement=r.displacement * (1.0 + 0.1 * max(0, count - 1)))


def softer_under_load(
    r: DenseResponse, loads: Sequence[Load], before: Response | None
) -> DenseResponse:
    del before
    return replace(r, compliance=r.compliance * (1.0 + 0.1 * sum(one.force for one in loads)))


def too_much_energy(
    r: DenseResponse, loads: Sequence[Load], before: Response | None
) -> DenseResponse:
    del loads, before
    return replace(r, energy=1.5 * r.energy)


def energy_in_advance(
    r: DenseResponse, loads: Sequence[Load], before: Response | None
) -> DenseResponse:
    """A viscous balloon that stores the energy of the steady state before it is there."""
    del before
    return replace(r, energy=BALLOON.respond(loads).energy)


def with_friction(force: float, before: float, k: float) -> float:
    """A spring beside a slider that sticks up to 0.05 N: hysteresis at any speed."""
    stick = 0.05
    return min(max(before, (force - stick) / k), (force + stick) / k)


def too_soft(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    """It reports a larger C than it has."""
    del loads, before
    return replace(r, compliance=1.5 * r.compliance)


class NeverFree(DenseResponse):
    """The surface without a load is the one with it."""

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        del loads, forces
        return np.asarray(self.displacement[vertices])


def never_free(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    del loads, before
    return NeverFree(r.displacement, r.fields, r.compliance, r.energy)


@dataclass(frozen=True, eq=False)
class Marked(DenseResponse):
    """A response after a press by one hand alone."""


def remembering(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    """A vertex that no contact covers stays out once a single hand has pressed."""
    if len(loads) != 1 and not isinstance(before, Marked):
        return r
    u = np.array(r.displacement)
    if len(loads) > 1:
        covered = np.unique(np.concatenate([load.vertices for load in loads]))
        u[np.setdiff1d(np.arange(len(u)), covered)[0]] += 1e-4
    return Marked(u, r.fields, r.compliance, r.energy)


def overshooting(force: float, before: float, k: float) -> float:
    """Each tick goes almost twice the way: it swings, and comes to rest under constant loads."""
    return before + 1.9 * (force / k - before)


class WrongTable(Changed):
    def vertex_compliance(self) -> Floats:
        return np.full(len(self.mesh.vertices), 1.0)


def unchanged(r: DenseResponse, loads: Sequence[Load], before: Response | None) -> DenseResponse:
    del loads, before
    return r


# The body that breaks each law, and whether it is checked as a linear one.
BROKEN: dict[str, tuple[Callable[[], Body], bool]] = {
    "rest_is_rest": (lambda: Changed(shifted), True),
    "response_depends_on_its_arguments_only": (lambda: Forgetful(unchanged), True),
    "order_of_loads_does_not_matter": (lambda: Changed(first_counts_more), True),
    "own_force_dents_inward": (lambda: Changed(outward), True),
    "compliance_is_symmetric_and_definite": (lambda: Changed(asymmetric), True),
    "reciprocity": (lambda: Changed(one_way), True),
    "displacements_add_up": (lambda: Changed(more_than_the_sum), True),
    "compliance_does_not_depend_on_load": (lambda: Changed(softer_under_load), True),
    "energy_is_half_the_work": (lambda: Changed(too_much_energy), True),
    "energy_is_paid_for": (
        lambda: Changed(energy_in_advance, Balloon(BALLOON.settings, damping=2.0)),
        True,
    ),
    "energy_is_a_potential": (lambda: Plate(with_friction), False),
    "compliance_is_the_steady_tangent": (lambda: Changed(too_soft), False),
    "parts_of_a_response_agree": (lambda: Changed(never_free), True),
    "steady_state_does_not_depend_on_the_way": (lambda: Changed(remembering), True),
    "a_hand_comes_to_rest": (lambda: Plate(overshooting), True),
    "table_is_of_contacts": (lambda: WrongTable(unchanged), True),
    "linear_spring_has_no_memory": (
        lambda: Changed(unchanged, Balloon(BALLOON.settings, damping=2.0)),
        True,
    ),
}
