from __future__ import annotations

import multiprocessing
from multiprocessing.connection import Connection

import numpy as np
import pytest

from cohaptic_server.bodies.solid.parts import factor_of
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factor_file import SharedFactor
from cohaptic_server.testing.blocks import block
from tests.server.cholesky.block_problem import in_single

pytestmark = pytest.mark.live

NODES = np.array([3, 40])
FORCES = np.arange(12.0).reshape(6, 2)


@pytest.fixture(scope="module")
def factor() -> Factor:
    mesh = block((0.1, 0.1, 0.1), (4, 4, 4))
    settings = SolidSettings(contact_radius=0.02)
    return factor_of(shape_of(mesh, mesh.vertices[:, 2] < 0.01, settings))


def test_it_solves_as_the_factor_in_single_precision_does(factor: Factor) -> None:
    shared = SharedFactor(factor, multiprocessing.get_context("spawn")).read()
    assert (shared.solve(NODES, FORCES) == in_single(factor).solve(NODES, FORCES)).all()
    assert shared.bytes == factor.bytes // 2


def test_a_multiple_is_shared_too(factor: Factor) -> None:
    shared = SharedFactor(factor.times(4.0), multiprocessing.get_context("spawn")).read()
    assert (4.0 * shared.solve(NODES, FORCES) == in_single(factor).solve(NODES, FORCES)).all()


def test_another_process_maps_it(factor: Factor) -> None:
    context = multiprocessing.get_context("spawn")
    shared = SharedFactor(factor, context)
    ours, theirs = context.Pipe()
    process = context.Process(target=_answer, args=(theirs, shared), daemon=True)
    process.start()
    theirs.close()
    found = ours.recv()
    process.join(30.0)
    assert (found == shared.read().solve(NODES, FORCES)).all()


def _answer(pipe: Connection, shared: SharedFactor) -> None:
    pipe.send(shared.read().solve(NODES, FORCES))
