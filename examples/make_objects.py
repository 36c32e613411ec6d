"""Make the objects of this folder, a torus and an organ like a liver; or many, sound and flawed.

    python examples/make_objects.py [--out examples]
    python examples/make_objects.py --many FOLDER
    python examples/make_objects.py --phantom FOLDER

All are in closed form or from a seed, so that the bytes are the same each time. The torus and the
organ are in metres and stand on z = 0. The many are those of `benchmarks/many_objects.py`: what
people bring, from a cube to a noisy scan, with holes, in other units and in every kind of file. The
phantom is a label map of an organ with a vessel and a tumour; with it comes a scene of two parts.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from shapes.catalogue import MANY

EXAMPLES = ("torus.stl", "organ.ply")
PHANTOM = ("phantom.nii.gz", "parts.glb")


def write(names: tuple[str, ...], folder: Path) -> None:
    """Write objects by their names, and say how large each file is."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        content = MANY[name]()
        (folder / name).write_bytes(content)
        print(f"{folder / name}: {len(content) / 1000:.0f} kB")


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    parser.add_argument("--many", type=Path, help="write all the shapes to this folder instead")
    parser.add_argument("--phantom", type=Path, help="write the phantom to this folder instead")
    options = parser.parse_args()
    if options.phantom is not None:
        write(PHANTOM, options.phantom)
    elif options.many is not None:
        write(tuple(MANY), options.many)
    else:
        write(EXAMPLES, options.out)


if __name__ == "__main__":
    main()
