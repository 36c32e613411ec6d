from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from cohaptic.errors import BodyError
from cohaptic_server.objects.store import cache as module
from cohaptic_server.objects.store.cache import load_arrays, save_arrays
from tests.examples_of_laws import examples

KINDS = st.sampled_from(["f8", "f4", "i8", "i4", "?", "u1"]).map(np.dtype)
ARRAYS = KINDS.flatmap(lambda kind: hnp.arrays(kind, hnp.array_shapes(min_dims=0, min_side=0)))


@given(arrays=st.dictionaries(st.text(max_size=5), ARRAYS, max_size=5), mapped=st.booleans())
@settings(max_examples=examples(60), deadline=None)
def test_arrays_are_loaded_as_they_were_saved(
    arrays: dict[str, npt.NDArray[Any]], mapped: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("arrays") / "a"
    save_arrays(path, arrays)
    read = load_arrays(path, mapped=mapped)
    assert read.keys() == arrays.keys()
    for name, array in arrays.items():
        assert read[name].dtype == array.dtype
        assert read[name].shape == array.shape
        assert read[name].tobytes() == array.tobytes()
        assert mapped or read[name].flags.writeable


def test_a_block_stored_by_columns_stays_so_and_lies_in_the_file(tmp_path: Path) -> None:
    """LAPACK takes it as it is, without a copy."""
    block = np.asfortranarray(np.arange(12.0).reshape(4, 3))
    save_arrays(tmp_path / "a", {"block": block, "rows": np.ascontiguousarray(block)})
    read = load_arrays(tmp_path / "a")
    assert read["block"].flags.f_contiguous
    assert read["rows"].flags.c_contiguous
    assert np.array_equal(read["block"], block)
    for array in read.values():
        assert not array.flags.writeable
        assert array.ctypes.data % 64 == 0


@given(data=st.data())
@settings(max_examples=examples(80), deadline=None)
def test_a_file_with_any_byte_changed_or_cut_off_is_refused_or_right(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("arrays") / "a"
    array = np.arange(40.0)
    save_arrays(path, {"a": array, "b": array[:3]})
    whole = bytearray(path.read_bytes())
    if data.draw(st.booleans()):
        place = data.draw(st.integers(0, len(whole) - 1))
        whole[place] ^= data.draw(st.integers(1, 255))
    else:
        del whole[data.draw(st.integers(0, len(whole) - 1)) :]
    path.write_bytes(bytes(whole))
    try:
        read = load_arrays(path)
    except BodyError:
        return
    assert np.array_equal(read["a"], array)  # the padding between arrays may have changed
    assert np.array_equal(read["b"], array[:3])


@pytest.mark.parametrize("content", [b"", b"no", b"PK\x03\x04" + bytes(200)])
def test_another_file_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(BodyError, match=r"too few|not a file of arrays"):
        load_arrays(tmp_path / "a")


def test_it_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_arrays(tmp_path / "a", {"a": np.arange(3.0)})
    with pytest.raises(BodyError, match=r"type <U1; stored are"):
        save_arrays(tmp_path / "a", {"a": np.arange(4.0), "words": np.array(["a"])})
    monkeypatch.setattr(module, "_DISK_RESERVE", 2**70)
    with pytest.raises(OSError, match="no room"):
        save_arrays(tmp_path / "a", {"a": np.arange(4.0)})
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert len(load_arrays(tmp_path / "a")["a"]) == 3
