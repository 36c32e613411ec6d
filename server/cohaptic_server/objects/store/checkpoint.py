"""A factor that is kept from the end of factoring until its object is stored as a whole.

It is in double precision, which the presses on the surface need; what is stored of the object at
the end may be less.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.cholesky import factor_file
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.objects.store.cache import SUFFIX, load_entry, save_entry, warn_unusable

_LABEL = "factor of an interrupted preparation"


class Checkpoint:
    """The factor of an object that is not stored yet, in a file beside the object's.

    Args:
        path: Path of the object's entry.
    """

    def __init__(self, path: Path) -> None:
        self._path = path.with_name(f"{path.name.removesuffix(SUFFIX)}-factor{SUFFIX}")

    def load(self) -> Factor | None:
        """The factor of an interrupted preparation; None if there is none that is intact."""
        arrays = load_entry(self._path, _LABEL)
        if arrays is None:
            return None
        try:
            factor = factor_file.from_arrays(arrays)
        except BodyError as error:
            warn_unusable(_LABEL, error)
            return None
        return factor if factor.fronts[-1].lower.dtype == np.float64 else None

    def save(self, factor: Factor) -> None:
        """Keep a factor until `remove`."""
        save_entry(self._path, _LABEL, factor_file.to_arrays(factor, np.float64))

    def remove(self) -> None:
        """Forget it: the object is stored."""
        self._path.unlink(missing_ok=True)
