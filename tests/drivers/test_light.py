"""The process of the haptic loop imports its driver, and has to start at once."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.live

HEAVY = ("numpy", "scipy", "pydantic", "asyncio", "websockets", "hid", "hidraw", "serial")


def test_no_driver_imports_what_is_heavy_before_its_device_is_opened() -> None:
    code = (
        "import sys\n"
        "from cohaptic_client.devices.catalogue import device_kind, names\n"
        "assert len([device_kind(name) for name in names()]) >= 8\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
