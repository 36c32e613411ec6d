"""Arrays in the wrong order or of the wrong length are errors at the door of a loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.compiled_modules import compiled_module, plain_module

ROWS = "cohaptic_server.world.loops.rows"
KINDS = [compiled_module, plain_module]


def contacts(n: int = 2, room: int = 5) -> dict[str, Any]:
    return {
        "frames": np.zeros((n, 3, 3)),
        "slopes": np.ones(n),
        "starts": np.arange(n + 1),
        "vertices": np.zeros(room, np.int64),
        "weights": np.zeros(room),
    }


def fields(n: int = 2, room: int = 5) -> dict[str, Any]:
    return {
        "starts": np.arange(n + 1),
        "vertices": np.zeros(room, np.int64),
        "values": np.zeros((room, 3)),
    }


def windows(n: int = 2, room: int = 5) -> dict[str, Any]:
    parts = ("vertices", "fitted", "touched", "carried")
    return {
        "geometry": np.zeros(n, np.int64),
        "keys": np.zeros((n, 7)),
        "starts": np.zeros((3, n + 1), np.int64),
        **{part: np.zeros(room, np.int64) for part in parts},
    }


def requests(n: int = 2) -> dict[str, Any]:
    return {
        "geometry": np.zeros(n, np.int64),
        "frames": np.zeros((n, 3, 3)),
        "slides": np.zeros((n, 3)),
        "directions": np.zeros((n, 3)),
        "horizons": np.zeros(n),
        "lengths": np.zeros(n),
        "half_widths": np.zeros(n),
    }


STRUCTURES = {
    "ContactRows": contacts,
    "FieldRows": fields,
    "WindowRows": windows,
    "WindowRequests": requests,
}


@pytest.mark.parametrize("name", STRUCTURES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_structure_has_the_arrays_that_it_was_given(name: str, kind: Any) -> None:
    given_arrays = STRUCTURES[name]()
    made = getattr(kind(ROWS), name)(*given_arrays.values())
    for key, array in given_arrays.items():
        assert np.shares_memory(np.asarray(getattr(made, key)), array)


@pytest.mark.parametrize("name", STRUCTURES)
@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data())
def test_one_array_that_is_longer_or_shorter_is_an_error(
    name: str, kind: Any, data: st.DataObject
) -> None:
    arrays = STRUCTURES[name]()
    # The starts of fields say themselves how many users there are.
    keys = sorted(arrays.keys() - ({"starts"} if name == "FieldRows" else set()))
    key = data.draw(st.sampled_from(keys))
    if name == "FieldRows":
        arrays[key] = arrays[key][:1]  # more than the starts need are allowed
    elif data.draw(st.booleans()):
        arrays[key] = np.concatenate([arrays[key], arrays[key]])
    else:
        arrays[key] = np.ascontiguousarray(arrays[key][:-1])
    with pytest.raises(ValueError, match=r"there must be|shape|places"):
        getattr(kind(ROWS), name)(*arrays.values())


@pytest.mark.parametrize("name", STRUCTURES)
def test_two_arrays_in_each_others_place_are_an_error_where_their_types_differ(name: str) -> None:
    arrays = list(STRUCTURES[name]().values())
    for i, one in enumerate(arrays):
        for j, other in enumerate(arrays[:i]):
            if (one.dtype, one.ndim) == (other.dtype, other.ndim):
                continue
            swapped = [*arrays]
            swapped[i], swapped[j] = other, one
            with pytest.raises((ValueError, TypeError)):
                getattr(compiled_module(ROWS), name)(*swapped)


@pytest.mark.parametrize("starts", [[0, 3, 2], [0, 6, 6], [-1, 2, 3], [0, 2, 6]])
@pytest.mark.parametrize("kind", KINDS)
def test_parts_that_overlap_or_reach_too_far_are_an_error(kind: Any, starts: list[int]) -> None:
    with pytest.raises(ValueError, match="places"):
        kind(ROWS).FieldRows(*{**fields(), "starts": np.array(starts)}.values())


@pytest.mark.parametrize("kind", KINDS)
def test_a_row_of_nobody_is_an_error(kind: Any) -> None:
    check_rows = kind(ROWS).check_rows
    check_rows(np.array([-1, 0, 1]), 2)
    for rows in ([2], [-2]):
        with pytest.raises(ValueError, match="of 2"):
            check_rows(np.array(rows), 2)
