"""Fuzzed files by number: a seed draws the same ones, whichever formats are asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from random import Random

from fuzzing import surface_files, volume_files
from fuzzing.drafts import Draft
from fuzzing.mutations import mutated

_WRITERS: dict[str, Callable[[], Iterator[Draft]]] = {
    ".stl": surface_files.stl,
    ".obj": surface_files.obj,
    ".ply": surface_files.ply,
    ".glb": surface_files.glb_files,
    ".gltf": surface_files.gltf_files,
    ".3mf": surface_files.three_mf,
    ".off": surface_files.off,
    ".msh": volume_files.msh,
    ".vtk": volume_files.vtk,
    ".vtu": volume_files.vtu,
    ".nii": volume_files.nii,
    ".nii.gz": volume_files.nii_gz,
    ".nrrd": volume_files.nrrd,
}
KINDS = tuple(_WRITERS)
SIMPLIFY = 100  # triangles to which some of the files are simplified
_SIMPLIFIED = 0.2  # share of these files


@cache
def drafts(kind: str) -> tuple[Draft, ...]:
    """Return the valid files of a kind, such as `.stl`."""
    return tuple(_WRITERS[kind]())


@dataclass(frozen=True, eq=False)
class Case:
    """One fuzzed file.

    Args:
        kind: Suffix of the file.
        seed: Seed of all files.
        number: Number of the file among those of its kind.
        draft: The file with its faults.
        faults: Names of the faults.
        simplify: Number of triangles that the surface is simplified to; 0 keeps all.
    """

    kind: str
    seed: int
    number: int
    draft: Draft
    faults: tuple[str, ...]
    simplify: int

    @property
    def name(self) -> str:
        """Name of the file, which says how to make it again."""
        simplified = f"-simplify{self.simplify}" if self.simplify else ""
        faults = "+".join(self.faults)
        return f"seed{self.seed}-{self.number:06}{simplified}-{faults}{self.kind}"


def case(kind: str, seed: int, number: int) -> Case:
    """The fuzzed file of a kind that a seed and a number draw."""
    draw = Random(f"{kind} {seed} {number}")
    chosen = draw.choice(drafts(kind))
    simplify = SIMPLIFY if draw.random() < _SIMPLIFIED else 0
    return Case(kind, seed, number, *mutated(chosen, draw), simplify)


def cases(count: int, seed: int, kinds: Sequence[str] = KINDS) -> Iterator[Case]:
    """So many fuzzed files, of each kind in turn."""
    for k in range(count):
        yield case(kinds[k % len(kinds)], seed, k // len(kinds))
