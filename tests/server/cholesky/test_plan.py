from __future__ import annotations

import weakref

import numpy as np
import pytest

from cohaptic_server.cholesky import factorise as module
from cohaptic_server.cholesky.plan import plan_of
from cohaptic_server.cholesky.symbolic import graph_of
from cohaptic_server.numeric import Floats
from tests.server.cholesky.block_problem import on_surface, problem


def test_the_bytes_of_the_factor_are_known_before_it() -> None:
    matrix, points = problem()
    for retained in (on_surface(points), np.ones(len(points), dtype=np.bool_)):
        plan = plan_of(graph_of(matrix), points, retained)
        assert plan.factor_bytes == module.factorise(matrix, points, retained).bytes
        assert plan.factor_bytes <= plan.peak_bytes
        assert (np.diff(plan.work) > 0.0).all()


def test_no_more_memory_is_taken_than_was_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside the factor, of which the plan counts what is written by then."""
    matrix, points = problem()
    retained = on_surface(points)
    plan = plan_of(graph_of(matrix), points, retained)
    taken = [0, 0]  # now, and at most [bytes]
    zeros = module._zeros  # pyright: ignore[reportPrivateUsage]

    def counted(count: int) -> Floats:
        def let_go() -> None:
            taken[0] -= 8 * count

        array = zeros(count)
        taken[0] += 8 * count
        taken[1] = max(taken)
        weakref.finalize(array, let_go)
        return array

    monkeypatch.setattr(module, "_zeros", counted)
    factor = module.factorise(matrix, points, retained)
    assert taken[0] == factor.bytes  # no update is left
    assert taken[1] - factor.bytes <= plan.peak_bytes <= taken[1]
    assert taken[1] - factor.bytes > 0.1 * plan.factor_bytes
