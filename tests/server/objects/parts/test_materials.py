from __future__ import annotations

import numpy as np
import pytest

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.objects.option import parse_values
from cohaptic_server.objects.parts.materials import PartMaterials
from cohaptic_server.objects.parts.parts import Parts

NAMES = ("liver", "left lobe", "tumour")
PARTS = Parts(NAMES, np.array([0, 1, 2, 2]))


def test_values_are_read_with_and_without_names() -> None:
    assert parse_values("--young", ["20e3", "left lobe=3e3", "a=b=4"]) == (
        20e3,
        (("left lobe", 3e3), ("a=b", 4.0)),
    )
    assert parse_values("--young", []) == (None, ())


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["soft"], "--young is 'soft'; it must be a number, or NAME=number"),
        (["=4"], "--young is '=4'; it must be NAME=number"),
        (["1e3", "2e3"], "--young is 1000 and 2000; it must be once without a name"),
    ],
)
def test_values_that_are_none_are_refused(texts: list[str], words: str) -> None:
    with pytest.raises(SettingError, match=words.replace("+", r"\+")):
        parse_values("--young", texts)


def test_each_piece_has_the_material_of_its_part() -> None:
    given = PartMaterials(young=(("tumour", 6e4),), nu=(("left lobe", 0.2),))
    moduli = given.moduli(SolidSettings(young=5e3, nu=0.4), PARTS, np.array([3, 0, 1, 1]))
    assert moduli.young.tolist() == [6e4, 5e3, 5e3, 5e3]
    assert moduli.nu.tolist() == [0.4, 0.4, 0.2, 0.2]


@pytest.mark.parametrize(
    ("given", "names", "words"),
    [
        (
            PartMaterials(young=(("tumor", 6e4),)),
            NAMES,
            "--young is given for tumor; it must be for parts of this file, which are: liver, left"
            " lobe, tumour",
        ),
        (
            PartMaterials(nu=(("tumour", 0.2),), every_nu=True),
            NAMES,
            "--poisson is given for tumour; .* no value has liver, left lobe",
        ),
        (PartMaterials(young=(("tumour", 6e4),)), (), "this file has no parts"),
    ],
)
def test_names_that_do_not_fit_are_told_with_those_that_exist(
    given: PartMaterials, names: tuple[str, ...], words: str
) -> None:
    with pytest.raises(SettingError, match=words):
        given.check(names)


def test_values_out_of_range_are_refused() -> None:
    with pytest.raises(SettingError, match="Young's modulus is 1 Pa"):
        PartMaterials(young=(("a", 1.0),))
    with pytest.raises(SettingError, match="Poisson's ratio is nan"):
        PartMaterials(nu=(("a", float("nan")),))
    with pytest.raises(SettingError, match="given twice for a"):
        PartMaterials(young=(("a", 1e4), ("a", 2e4)))


def test_parts_need_names_of_their_own_and_indices_of_theirs() -> None:
    with pytest.raises(BodyError, match="names of their own"):
        Parts(("a", "a"), np.array([0, 1]))
    with pytest.raises(BodyError, match="names part 2 of 1"):
        Parts(("a",), np.array([0, 2]))
