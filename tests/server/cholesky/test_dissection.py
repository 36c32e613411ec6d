from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.cholesky.symbolic import Part, dissect
from cohaptic_server.numeric import Ints
from tests.examples_of_laws import examples
from tests.server.cholesky.block_problem import grid


def subtree(parts: list[Part], k: int) -> Ints:
    below = [subtree(parts, child) for child in parts[k].children]
    return np.concatenate([parts[k].own, *below])


@given(st.integers(2, 6), st.integers(1, 40))
@settings(max_examples=examples(15), deadline=None)
def test_halves_do_not_touch_and_every_node_is_in_one_part(n: int, leaf: int) -> None:
    elements, points = grid(n)
    member = sp.csr_array(
        (
            np.ones(elements.size),
            (elements.ravel(), np.repeat(np.arange(len(elements)), elements.shape[1])),
        )
    )
    graph = sp.csr_array(member @ member.T)
    parts = dissect(points, graph, leaf)
    assert sorted(np.concatenate([part.own for part in parts]).tolist()) == list(range(n**3))
    for k, part in enumerate(parts):
        assert all(child < k for child in part.children)
        if part.children:
            one, other = (subtree(parts, child) for child in part.children)
            assert graph[one][:, other].nnz == 0
