"""The image's own line of installation, run by pip with small wheels in place of ours."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from containers import ROOT

DOCKERFILE = (ROOT / "deploy/Dockerfile").read_text()


def a_wheel(folder: Path, name: str, version: str, *needs: str) -> None:
    info = f"{name}-{version}.dist-info"
    head = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\nProvides-Extra: more\n"
    with zipfile.ZipFile(folder / f"{name}-{version}-py3-none-any.whl", "w") as wheel:
        wheel.writestr(f"{name}.py", f"VERSION = {version!r}")
        wheel.writestr(f"{info}/METADATA", head + "".join(f"Requires-Dist: {n}\n" for n in needs))
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
        wheel.writestr(f"{info}/RECORD", "")


def installed(folder: Path, extras: str) -> set[str]:
    """What the line of the Dockerfile installs from the wheels in `folder / "dist"`."""
    (line,) = re.findall(r"^RUN (python -m venv (?:.*\\\n)*.*)$", DOCKERFILE, re.M)
    places = {"/opt/cohaptic": f"{folder}/venv", "/tmp": f"{folder}/dist"}
    command = re.sub("|".join(places), lambda place: places[place[0]], line)
    programs = folder / "bin"
    programs.mkdir()
    (programs / "python").symlink_to(sys.executable)
    environment = {
        **os.environ,
        "EXTRAS": extras,
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PIP_NO_INDEX": "1",  # as on a machine that has no network
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    }
    done = subprocess.run(
        ["sh", "-ec", command], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = folder.glob("venv/lib/*/site-packages/*.dist-info")
    return {path.name.removesuffix(".dist-info") for path in found} - {
        path.name.removesuffix(".dist-info")
        for path in folder.glob("venv/lib/*/site-packages/pip-*")
    }


@pytest.mark.live
def test_the_image_installs_from_our_wheel_alone(tmp_path: Path) -> None:
    (tmp_path / "dist").mkdir()
    a_wheel(tmp_path / "dist", "cohaptic", "1.10")
    assert "cohaptic-1.10" in installed(tmp_path, "")
