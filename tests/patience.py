"""How long tests wait for what has to come: far more than it takes, so that only a hang fails."""

from __future__ import annotations

import os

# On a machine that is slower still, COHAPTIC_PATIENCE=3 waits three times as long everywhere.
SCALE = float(os.environ.get("COHAPTIC_PATIENCE", "1"))
PATIENCE = 60.0 * SCALE  # s
