"""The type of a factor's values: arrays in single or in double precision."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

AnyFloats = npt.NDArray[np.float32 | np.float64]
