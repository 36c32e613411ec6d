from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import MAX_AWAY, VolumeLostError
from cohaptic_server.objects.surface.accept import check_deviation
from cohaptic_server.objects.tetrahedralise import envelope

SOURCE = ObjectFile(Path("ear.stl"), "z < 10%")


@pytest.mark.parametrize("edge", [0.02, 0.05, 0.15, 0.5])
@pytest.mark.parametrize("size", [0.01, 0.2, 5.0])
def test_tetrahedra_may_be_off_by_their_envelope_and_a_little_more(
    edge: float, size: float
) -> None:
    source, limit = replace(SOURCE, edge=edge), (envelope(edge) + MAX_AWAY) * size
    check_deviation(source, size, 0.999 * limit)
    with pytest.raises(VolumeLostError, match=r"^ear.stl: the tetrahedra end .* mm from a part"):
        check_deviation(source, size, 1.001 * limit)
    # Who asks for it gets what there is.
    check_deviation(replace(source, repair=True), size, size)
