from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cohaptic.vec import Vec3, cross, dot, norm, scale, sub
from cohaptic_drivers.woodenhaptics.kinematics import (
    Columns,
    joint_angles,
    motor_currents,
    polhem_position,
    pose_at,
)
from cohaptic_drivers.woodenhaptics.unit import UNITS, Unit
from tests.strategies import vectors

WOODEN, POLHEM = UNITS["woodenhaptics"], UNITS["polhem"]
FREE = {name: replace(unit, max_current=1e6) for name, unit in UNITS.items()}
STEP = 1e-5  # rad
counts = st.tuples(*[st.floats(-1500.0, 1500.0)] * 3)


def of_chai3d(v: Vec3) -> Vec3:
    """Right, away, up, of the frame in which the facts speak: toward the user, right, up."""
    return (v[1], -v[0], v[2])


def pose(unit: Unit, raw: Vec3) -> tuple[Vec3, Columns]:
    found = pose_at(unit, joint_angles(unit, raw))
    assert found is not None
    return found.position, found.jacobian


@pytest.mark.parametrize(
    ("raw", "angles", "position", "milliamps"),
    [
        ((0, 0, 0), (0, 0, 1.570796), (0.025, 0, 0.205), (1182.4, -659.6, -2364.9)),
        (
            (1000, -2000, 500),
            (0.196350, 0.523599, 1.439897),
            (0.118767, 0.067385, 0.145556),
            (1472.4, 206.3, -2485.7),
        ),
        (
            (-700, -1500, -900),
            (-0.137445, 0.392699, 1.806416),
            (0.093694, -0.043389, 0.246589),
            (1618.7, 320.6, -2167.7),
        ),
    ],
)
def test_kinematics_match_the_vectors_of_the_published_model(
    raw: Vec3, angles: Vec3, position: Vec3, milliamps: Vec3
) -> None:
    assert joint_angles(WOODEN, raw) == pytest.approx(angles, abs=1e-6)
    tip, jacobian = pose(WOODEN, raw)
    assert tip == pytest.approx(of_chai3d(position), abs=1e-6)
    given = motor_currents(FREE["woodenhaptics"], jacobian, of_chai3d((1.0, 2.0, 3.0)))
    assert scale(given, 1e3) == pytest.approx(milliamps, abs=0.06)


def test_a_closed_chain_that_cannot_close_is_no_pose() -> None:
    assert polhem_position((0.0, 0.0, math.pi)) is None
    assert pose_at(POLHEM, (0.0, 0.0, math.pi)) is None


@pytest.mark.parametrize("name", ["woodenhaptics", "vintage"])
@given(counts)
def test_the_jacobian_is_the_change_of_the_tip(name: str, raw: Vec3) -> None:
    unit = UNITS[name]
    angles = joint_angles(unit, raw)
    _, jacobian = pose(unit, raw)
    for i in range(3):
        low, high = list(angles), list(angles)
        low[i], high[i] = low[i] - STEP, high[i] + STEP
        before = pose_at(unit, (low[0], low[1], low[2]))
        after = pose_at(unit, (high[0], high[1], high[2]))
        assert before is not None
        assert after is not None
        numeric = scale(sub(after.position, before.position), 0.5 / STEP)
        assert jacobian[i] == pytest.approx(numeric, abs=1e-9)


@pytest.mark.parametrize("name", UNITS)
@given(counts, vectors(5.0), vectors(1.0))
def test_motors_give_the_power_that_the_hand_gets(
    name: str, raw: Vec3, force: Vec3, turning: Vec3
) -> None:
    """F . v of the tip is the sum of torque constant times current times speed of the motor."""
    unit = FREE[name]
    found = pose_at(unit, joint_angles(unit, raw))
    assume(found is not None)
    assert found is not None
    velocity = tuple(sum(found.jacobian[i][k] * turning[i] for i in range(3)) for k in range(3))
    currents = motor_currents(unit, found.jacobian, force)
    power = sum(
        unit.torque_constants[i]
        * currents[i]
        * (unit.directions[i] * turning[i] * unit.drums[i] / unit.capstans[i])
        for i in range(3)
    )
    assert power == pytest.approx(dot(force, (velocity[0], velocity[1], velocity[2])), abs=1e-9)


@given(counts, vectors(100.0))
def test_motors_saturate_together_and_the_force_keeps_its_direction(raw: Vec3, force: Vec3) -> None:
    _, jacobian = pose(WOODEN, raw)
    wanted = motor_currents(FREE["woodenhaptics"], jacobian, force)
    given_currents = motor_currents(WOODEN, jacobian, force)
    assert max(map(abs, given_currents)) <= WOODEN.max_current * (1.0 + 1e-12)
    size = norm(wanted) * norm(given_currents)
    assert norm(cross(wanted, given_currents)) <= 1e-9 * max(1.0, size)
    assert dot(wanted, given_currents) >= 0.0
    if max(map(abs, wanted)) <= WOODEN.max_current:
        assert given_currents == wanted


@pytest.mark.parametrize("force", [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0)])
def test_what_is_no_force_gives_no_current(force: Vec3) -> None:
    _, jacobian = pose(WOODEN, (0.0, 0.0, 0.0))
    assert motor_currents(WOODEN, jacobian, force) == (0.0, 0.0, 0.0)
