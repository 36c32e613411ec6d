"""Checks the laws of elasticity on a body, of this package or of any other.

    check_body(MyBody())

A body says with its attribute `linear` whether it is a linear spring. One that says so has to
superpose and to remember nothing. A damped body, whose `linear` is False, may superpose, too:

    check_body(MyDampedBody(), linear=True)

The checks apply loads at a few compliant vertices, and compare the depths of these contacts in the
first tick and in the steady state.

Each law is a function that asserts the law; an error names the broken law. Before them come
the checks of `body_form.py`. The laws are those invariants of science 3.6 that can be checked
through the `Body` Protocol, and those properties of a body on which the control laws of science 3.1
and 3.3 rely.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Protocol, TypeVar

import numpy as np

from cohaptic_server.bodies.body import Body, Load, Response
from cohaptic_server.bodies.touched_body import Surveyed
from cohaptic_server.mesh.surface import pressure, spread_over
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.body_form import FORMS, BrokenLawError, keep

_CANDIDATES = 40  # vertices spread over the surface that are tried as contacts
_SOFT = 0.05  # least compliance of a contact over that of the softest candidate

R_co = TypeVar("R_co", bound=Response, covariant=True)


def press_vertex(body: Body, vertex: int, force: float) -> Load:
    """Return a load of `force` [N] against the normal at a vertex, with the contact radius."""
    mesh = body.mesh
    vertices, weights = pressure(
        mesh, mesh.vertices[vertex], body.contact_radius, mesh.normals[vertex]
    )
    return Load(vertices, weights, -mesh.normals[vertex], force)


def soft_contacts(body: Body, count: int) -> list[Load]:
    """Return `count` loads of zero force at compliant vertices far from each other.

    Raises:
        ValueError: The body has too few vertices that are compliant enough.
    """
    vertices = spread_over(body.mesh.vertices, _CANDIDATES)
    loads = [press_vertex(body, int(k), 0.0) for k in vertices]
    own = np.array([float(body.respond([load]).compliance[0, 0]) for load in loads])
    soft = [loads[i] for i in np.flatnonzero(own > _SOFT * own.max())]
    if len(soft) < count:
        raise ValueError(f"{body.name} can be pressed at {len(soft)} of {len(loads)} points")
    return soft[:count]


def pressed(loads: Sequence[Load], forces: Sequence[float] | Floats) -> list[Load]:
    """Return copies of the loads with other forces, one for each load [N]."""
    return [replace(load, force=float(force)) for load, force in zip(loads, forces, strict=True)]


def depth(load: Load, response: Response) -> float:
    """Return the displacement of a contact along its force [m]."""
    return float(load.weights @ (response.displacement_of(load.vertices) @ load.direction))


def depths(loads: Sequence[Load], response: Response) -> Floats:
    """Return the displacement of each contact along its force, shape (c,) [m]."""
    return np.array([depth(load, response) for load in loads])


class Responding(Protocol[R_co]):
    """The part of a body that `settled` uses, generic in the type of the response."""

    @property
    def name(self) -> str:
        """Name of the body for messages."""
        ...

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> R_co:
        """Return the response as `Body.respond` does."""
        ...


def settled(
    body: Responding[R_co],
    loads: Sequence[Load],
    before: Response | None = None,
    *,
    tolerance: float = 1e-11,
    ticks: int = 400,
) -> R_co:
    """Return the steady response to constant loads.

    Args:
        before: Response to start from; None for rest.
        tolerance: Largest motion of any vertex in the last tick and in the tick before it, since an
            oscillating body hardly moves in the one tick in which it turns back [m].
        ticks: Largest number of ticks.

    Raises:
        AssertionError: The body still moves after that many ticks.
    """
    response, change = body.respond(loads, before), np.inf
    for _ in range(ticks):
        previous, response, last = response, body.respond(loads, response), change
        change = float(np.abs(response.displacement - previous.displacement).max())
        if max(change, last) <= tolerance:
            return response
    raise AssertionError(f"{body.name} still moves {change:g} m in a tick after {ticks} ticks")


_EXACT = 1e-6  # relative tolerance; columns are kept in single precision
_TANGENT = 2e-3  # relative; finite differences, and decaying loads that a viscous body drops
_TABLE = 0.05  # relative; a client scales the table by the exact C_ii of each patch
_TABLE_PRESSES = 12  # vertices of the table that are checked by a load, roughly
_DIFFERENCE = 0.02  # step of the force in a finite difference, over the force


@dataclass(frozen=True, eq=False)
class Subject:
    """A body under check, and the loads of the check.

    Args:
        linear: Whether displacements under several loads add up.
        loads: Loads at a few distant contacts, each with a different force.
        forces: Forces of the loads, shape (c,) [N].
        scale: Displacement that the loads cause, for tolerances [m].
    """

    body: Body
    linear: bool
    loads: list[Load]
    forces: Floats
    scale: float


def rest_is_rest(subject: Subject) -> None:
    """Assert that zero force causes no displacement and no energy.

    The shape of the compliance matrix C is checked, too: a row and a column for each load.
    """
    body, c = subject.body, len(subject.loads)
    for loads in ([], pressed(subject.loads, np.zeros(c))):
        response = body.respond(loads)
        _near(response.displacement, 0.0, _EXACT * subject.scale, "displacement at rest")
        assert abs(response.energy) <= _energy_scale(subject) * _EXACT, "energy at rest"
        assert response.compliance.shape == (len(loads), len(loads)), "shape of C"


def compliance_is_symmetric_and_definite(subject: Subject) -> None:
    """Assert that the compliance C is symmetric (Maxwell, Betti) without negative eigenvalues."""
    for response in (subject.body.respond(subject.loads), settled(subject.body, subject.loads)):
        C = response.compliance
        size = np.abs(C).max()
        _near(C, C.T, _EXACT * size, "C and its transpose")
        least = np.linalg.eigvalsh(0.5 * (C + C.T)).min()
        # Points of a rigid plate move together: an eigenvalue of zero is allowed.
        assert least >= -_EXACT * size, f"smallest eigenvalue of C is {least:g} m/N"


def own_force_dents_inward(subject: Subject) -> None:
    """Assert that a force moves its own contact inward, in the first tick and when steady."""
    for load in subject.loads:
        first = depth(load, subject.body.respond([load]))
        last = depth(load, settled(subject.body, [load]))
        assert first > 0.0, f"a press moves its contact by {first:g} m"
        assert last > 0.0, f"a press holds its contact at {last:g} m"


def reciprocity(subject: Subject) -> None:
    """Assert that a small force at contact i moves contact j as much as the force at j moves i."""
    fraction = 0.01
    loads = pressed(subject.loads, np.full(len(subject.loads), fraction * subject.forces.min()))
    moved = np.array([depths(loads, settled(subject.body, [load])) for load in loads])
    limit = _EXACT if subject.linear else 0.05
    _near(moved, moved.T, limit * np.abs(moved).max(), "depths and their transpose")


def compliance_is_the_steady_tangent(subject: Subject) -> None:
    """Assert that the compliance C is the derivative of the steady depths by the present forces.

    A control loop with delay depends on the steady compliance (science 3.1); gains from a C below
    half of it are not safe (3.3).
    """
    body, loads = subject.body, subject.loads
    steady = settled(body, loads)
    C = steady.compliance
    for i, force in enumerate(subject.forces):
        h = _DIFFERENCE * force
        up, down = (
            settled(body, pressed(loads, subject.forces + s * h * np.eye(len(loads))[i]), steady)
            for s in (1.0, -1.0)
        )
        slope = (depths(loads, up) - depths(loads, down)) / (2.0 * h)
        _near(C[:, i], slope, _TANGENT * np.abs(C).max(), f"C and differences by force {i}")


def displacements_add_up(subject: Subject) -> None:
    """Assert that displacements of a linear body add up, and are proportional to the loads."""
    body, loads = subject.body, subject.loads
    both = settled(body, loads).displacement
    apart = sum(settled(body, [load]).displacement for load in loads)
    _near(both, np.asarray(apart), _tolerance(subject), "displacement and the sum over loads")
    half = settled(body, pressed(loads, 0.5 * subject.forces)).displacement
    _near(2.0 * half, both, _tolerance(subject), "twice the displacement under half of the loads")


def compliance_does_not_depend_on_load(subject: Subject) -> None:
    """Assert that the compliance C of a linear body, and so its stiffness, is constant."""
    at_rest = subject.body.respond(pressed(subject.loads, np.zeros(len(subject.loads))))
    C, loaded = at_rest.compliance, settled(subject.body, subject.loads).compliance
    _near(loaded, C, _EXACT * np.abs(C).max(), "C under load and at rest")


def energy_is_half_the_work(subject: Subject) -> None:
    """Assert that a linear body under steady forces f stores the energy f' C f / 2 [J]."""
    steady = settled(subject.body, subject.loads)
    half = 0.5 * float(subject.forces @ steady.compliance @ subject.forces)
    _near(np.array(steady.energy), half, _TANGENT * half, "energy and half of the work")


def energy_is_paid_for(subject: Subject) -> None:
    """Assert that the stored energy never grows by more than the work of the forces in a tick."""
    body, count = subject.body, len(subject.loads)
    rng = np.random.default_rng(0)
    response = body.respond(pressed(subject.loads, np.zeros(count)))
    for tick in range(60):
        fraction = rng.uniform(0.0, 1.0, count) if 8 <= tick < 40 else np.full(count, tick < 8)
        loads = pressed(subject.loads, fraction * subject.forces)
        previous, response = response, body.respond(loads, response)
        moved = depths(loads, response) - depths(loads, previous)
        work = float((fraction * subject.forces) @ moved)
        gain = response.energy - previous.energy
        limit = work + _TANGENT * _energy_scale(subject)
        assert gain <= limit, f"{gain:g} J stored for {work:g} J of work in tick {tick}"
        assert response.energy >= -_EXACT * _energy_scale(subject), "stored energy is negative"


def energy_is_a_potential(subject: Subject) -> None:
    """Assert that the energy between steady states changes by the work, loading or unloading."""
    body, loads = subject.body, subject.loads
    fractions = np.concatenate([np.linspace(0.0, 1.0, 9), np.linspace(1.0, 0.0, 9)[1:]])
    states: list[tuple[Floats, Floats, float]] = []
    response: Response | None = None
    for fraction in fractions.tolist():
        response = settled(body, pressed(loads, fraction * subject.forces), response)
        states.append((fraction * subject.forces, depths(loads, response), response.energy))
    work = 0.0
    for (f, x, _), (g, y, energy) in pairwise(states):
        work += 0.5 * float((f + g) @ (y - x))
        limit = 0.01 * _energy_scale(subject)
        assert abs(energy - work) <= limit, f"energy {energy:g} J after work of {work:g} J"


def order_of_loads_does_not_matter(subject: Subject) -> None:
    """Assert that permuted loads permute the compliance matrix, and change nothing else."""
    body, loads = subject.body, subject.loads
    order = [*range(1, len(loads)), 0]
    one, two = body.respond(loads), body.respond([loads[i] for i in order])
    _near(two.displacement, one.displacement, _tolerance(subject), "displacement, permuted")
    C = one.compliance[np.ix_(order, order)]
    _near(two.compliance, C, _EXACT * np.abs(C).max(), "C, permuted")
    assert abs(two.energy - one.energy) <= _EXACT * _energy_scale(subject), "energy, permuted"


def response_depends_on_its_arguments_only(subject: Subject) -> None:
    """Assert that a response depends only on the loads and the earlier response passed to it.

    Calls in between, with other arguments, must not change it.
    """
    body, loads = subject.body, subject.loads
    before = body.respond(loads[:1])
    earlier = np.array(before.displacement)
    first = body.respond(loads, before)
    first_u, first_C = np.array(first.displacement), np.array(first.compliance)
    body.respond(pressed(loads[::-1], 3.0 * subject.forces), first)
    again = body.respond(loads, before)
    limit = _tolerance(subject)
    _near(again.displacement, first_u, limit, "displacement, asked again")
    _near(again.compliance, first_C, _EXACT * np.abs(first_C).max(), "C, asked again")
    _near(before.displacement, earlier, limit, "displacement of the earlier response")
    _near(first.displacement, first_u, limit, "displacement of the first response")


def steady_state_does_not_depend_on_the_way(subject: Subject) -> None:
    """Assert that a body reaches the same equilibrium from rest as from another steady state."""
    body, loads = subject.body, subject.loads
    cold = settled(body, loads)
    warm = settled(body, loads, settled(body, loads[:1]))
    limit = max(_tolerance(subject), 1e-8)  # m; a viscous body forgets loads gradually
    _near(warm.displacement, cold.displacement, limit, "steady displacement")


def parts_of_a_response_agree(subject: Subject) -> None:
    """Assert that `at` and `without` of a response agree with its displacement and compliance.

    `without` gives the x_free of science 3.3.
    """
    body, loads = subject.body, subject.loads
    response = settled(body, loads)
    some = np.arange(0, len(body.mesh.vertices), 3)
    u, limit = response.displacement, _tolerance(subject)
    assert u.shape == body.mesh.vertices.shape, f"shape of the displacement is {u.shape}"
    _near(response.displacement_of(some), u[some], limit, "at() and displacement")
    for i, load in enumerate(loads):
        force = subject.forces[i : i + 1]
        free = response.without(slice(i, i + 1), force, load.vertices)
        own = depth(load, response) - float(load.weights @ (free @ load.direction))
        expected = float(response.compliance[i, i] * force[0])
        _near(np.array(own), expected, limit, f"own dent of load {i} and C_ii f_i")


def a_hand_comes_to_rest(subject: Subject) -> None:
    """Assert that a simulated proportional hand comes to rest on the body at every delay.

    By eq. (8), a hand of stiffness K_h = K_o / 2, for the stiffness K_o of the body at the contact,
    comes to rest at the equilibrium of eq. (11).
    """
    body, load = subject.body, subject.loads[0]
    own = float(settled(body, [load]).compliance[0, 0])
    k_h, reach = 0.5 / own, 1.5 * depth(load, settled(body, [load]))
    for delay in (0, 2):
        past, response = [0.0] * (delay + 1), body.respond(pressed([load], [0.0]))
        force = 0.0
        for _ in range(60):
            force = max(0.0, k_h * (reach - past[-1 - delay]))
            response = body.respond(pressed([load], [force]), response)
            past.append(depth(load, response))
        steady = max(0.0, k_h * (reach - past[-1]))
        assert abs(force - steady) <= 0.01 * steady, f"force {force:g} N at delay {delay}"


def table_is_of_contacts(subject: Subject) -> None:
    """Assert that a body's table `vertex_compliance`, if any, agrees with loads at the vertices.

    The table holds the compliance C_ii of a load centred at each vertex.
    """
    body = subject.body
    if not isinstance(body, Surveyed):
        return
    mesh, table = body.mesh, body.vertex_compliance()
    assert table.shape == (len(mesh.vertices),), f"shape of the table is {table.shape}"
    for k in range(0, len(table), max(1, len(table) // _TABLE_PRESSES)):
        normal = mesh.normals[k]
        load = Load(*pressure(mesh, mesh.vertices[k], body.contact_radius, normal), -normal, 0.0)
        own = float(body.respond([load], None).compliance[0, 0])
        limit = _TABLE * abs(own) + _EXACT * float(np.abs(table).max())
        assert abs(table[k] - own) <= limit, f"vertex {k}: {table[k]:g} m/N, {own:g} pressed"
        assert (table[k] > 0.0) == (own > 0.0), f"vertex {k}: free and held are confused"


def linear_spring_has_no_memory(subject: Subject) -> None:
    """A body that says that it is a linear spring responds to the present loads alone."""
    body = subject.body
    if not body.linear:
        return
    before = body.respond(pressed(subject.loads, 0.5 * subject.forces[::-1]))
    u, anew = body.respond(subject.loads, before), body.respond(subject.loads)
    _near(u.displacement, anew.displacement, _tolerance(subject), "displacements after other loads")


Law = Callable[[Subject], None]
LINEAR_LAWS: tuple[Law, ...] = (
    displacements_add_up,
    compliance_does_not_depend_on_load,
    energy_is_half_the_work,
)
LAWS: tuple[Law, ...] = (
    rest_is_rest,
    response_depends_on_its_arguments_only,
    order_of_loads_does_not_matter,
    own_force_dents_inward,
    compliance_is_symmetric_and_definite,
    reciprocity,
    *LINEAR_LAWS,
    energy_is_paid_for,
    energy_is_a_potential,
    compliance_is_the_steady_tangent,
    parts_of_a_response_agree,
    steady_state_does_not_depend_on_the_way,
    a_hand_comes_to_rest,
    table_is_of_contacts,
    linear_spring_has_no_memory,
)


def _near(values: Floats, expected: Floats | float, tolerance: float, name: str) -> None:
    """Assert that values differ by no more than `tolerance`; NaN never passes."""
    gap = float(np.abs(np.asarray(values) - expected).max(initial=0.0))
    assert gap <= tolerance, f"{name} differ by {gap:g}, more than {tolerance:g}"


def _tolerance(subject: Subject) -> float:
    """Return the tolerance for differences of displacements [m]."""
    return _EXACT * subject.scale


def _energy_scale(subject: Subject) -> float:
    """Return the sum of the forces times the displacement that they cause [J]."""
    return float(subject.forces.sum()) * subject.scale


_CONTACTS = 3
_DENT = 0.15  # depth of a load over the contact radius: past small strains of a nonlinear body


def check_body(body: Body, *, linear: bool | None = None) -> None:
    """Check that a body has the form of one, and that it obeys the laws of elasticity.

    Args:
        body: Any implementation of the `Body` Protocol, also a viscous one.
        linear: Whether displacements under several loads add up; None for what the body says.

    Raises:
        BrokenLawError: The body breaks a law.
        ValueError: The body has too few vertices that are compliant enough.
    """
    for form in FORMS:
        keep(form, body)
    if linear is None:
        linear = body.linear
    at_rest = soft_contacts(body, _CONTACTS)
    C = body.respond(at_rest).compliance
    own = np.diag(C)
    if not (np.isfinite(C).all() and (own > 0.0).all()):
        raise BrokenLawError("own_force_dents_inward", f"C_ii is {own.tolist()} at rest")
    forces = _DENT * body.contact_radius / own * np.linspace(0.6, 1.0, len(own))
    scale = float((np.abs(C) @ forces).max())
    subject = Subject(body, linear, pressed(at_rest, forces), forces, scale)
    for law in LAWS if linear else (law for law in LAWS if law not in LINEAR_LAWS):
        keep(law, subject)
