"""A maker's library that is there and cannot be loaded, with the system's own loader."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cohaptic.errors import DeviceError
from cohaptic_drivers.vendor.library import load
from tests.give_up import give_up

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform != "linux", reason="the words are those of Linux's loader"),
]


def refusal(file: Path) -> str:
    with pytest.raises(DeviceError) as caught:
        load("touch", {"": "libHD.so"}, str(file), "OpenHaptics")
    assert f"its maker's library {file} cannot be loaded" in str(caught.value)
    return str(caught.value)


def make_library(folder: Path, name: str, *needs: str) -> Path:
    compiler = shutil.which("cc")
    if compiler is None:
        give_up("there is no C compiler")
    source, made = folder / f"{name}.c", folder / f"lib{name}.so"
    source.write_text(f"int {name}(void) {{ return 1; }}\n")
    links = [f"-L{folder}", "-Wl,--no-as-needed", *(f"-l{need}" for need in needs)]
    subprocess.run([compiler, "-shared", "-fPIC", "-o", made, source, *links], check=True)
    return made


def test_a_library_that_is_missing_is_to_be_installed(tmp_path: Path) -> None:
    words = refusal(tmp_path / "libHD.so")
    assert "loaded; install OpenHaptics, or tell where it is: touch:library=FILE" in words


def test_what_the_library_itself_needs_and_has_not_is_named(tmp_path: Path) -> None:
    needed = make_library(tmp_path, "needed")
    file = make_library(tmp_path, "maker", "needed")
    needed.unlink()
    words = refusal(file)
    assert "(libneeded.so: cannot open shared object file" in words
    assert "install" not in words
