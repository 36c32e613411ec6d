"""Materials of the parts of an object: `--young 5e3 --young tumour=60e3`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.bodies.solid.shape import Moduli, SolidSettings
from cohaptic_server.numeric import Ints
from cohaptic_server.objects.option import Named
from cohaptic_server.objects.parts.parts import Parts


@dataclass(frozen=True, slots=True)
class PartMaterials:
    """Materials of some parts; the other parts have the material of the object.

    Args:
        young: Young's moduli by name [Pa].
        nu: Poisson's ratios by name.
        every_young: Whether each part must have a modulus of its own.
        every_nu: Whether each part must have a Poisson's ratio of its own.

    Raises:
        SettingError: A value is out of its range, or a name is given twice.
    """

    young: Named = ()
    nu: Named = ()
    every_young: bool = False
    every_nu: bool = False

    def __post_init__(self) -> None:
        for option, named in (("--young", self.young), ("--poisson", self.nu)):
            names = [name for name, _ in named]
            twice = [name for name in names if names.count(name) > 1]
            if twice:
                raise SettingError(option, f"given twice for {twice[0]}", "one value for each part")
        for _, young in self.young:
            SolidSettings(young=young)
        for _, nu in self.nu:
            SolidSettings(nu=nu)

    def check(self, names: Sequence[str]) -> None:
        """Check that the values fit the parts of a file.

        Args:
            names: Names of the parts; empty for an object without parts.

        Raises:
            SettingError: A value names an unknown part, or a part has no value and needs one.
        """
        for option, named, every in (
            ("--young", self.young, self.every_young),
            ("--poisson", self.nu, self.every_nu),
        ):
            check_names(option, named, names)
            given = dict(named)
            missing = [name for name in names if name not in given]
            if every and missing:
                expected = (
                    f"given for each part, or once without a name for the others; of"
                    f" {_listed(names)}, no value has {_listed(missing)}"
                )
                raise SettingError(option, f"given for {_listed(tuple(given))}", expected)

    def moduli(self, material: SolidSettings, parts: Parts | None, elements: Ints) -> Moduli:
        """Elastic moduli of each element.

        Args:
            material: Material of parts that have no value of their own.
            parts: Parts of the tetrahedra; None for an object without parts.
            elements: Index of the tetrahedron that each element comes from, shape (k,).

        Raises:
            SettingError: A value names an unknown part, or a part has no value and needs one.
            BodyError: The stiffest part is too stiff for the softest one.
        """
        names = () if parts is None else parts.names
        self.check(names)
        if parts is None:
            return Moduli.uniform(len(elements), material.young, material.nu)
        each = np.array([self.of_part(material, name) for name in names])[parts.of[elements]]
        return Moduli(each[:, 0].copy(), each[:, 1].copy())

    def of_part(self, material: SolidSettings, name: str) -> tuple[float, float]:
        """Young's modulus [Pa] and Poisson's ratio of a part."""
        return dict(self.young).get(name, material.young), dict(self.nu).get(name, material.nu)


def check_names(option: str, named: Named, names: Sequence[str]) -> None:
    """Check that each value names an existing part.

    Args:
        option: Option of the command line, for the error.
        named: Values by the names of parts.
        names: Names of the parts; empty for an object without parts.

    Raises:
        SettingError: A value names an unknown part.
    """
    unknown = [name for name, _ in named if name not in names]
    if unknown:
        there = f"for parts of this file, which are: {_listed(names)}"
        if not names:
            there = "one value for all of it, without a name: this file has no parts"
        raise SettingError(option, f"given for {_listed(unknown)}", there)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
