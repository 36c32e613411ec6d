"""A maker's library that is there and cannot be loaded, with the system's own loader."""

from __future__ import annotations

import os
import platform
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


def test_a_library_for_another_processor_is_named_so(tmp_path: Path) -> None:
    file = make_library(tmp_path, "maker")
    code = bytearray(file.read_bytes())
    code[18] ^= 0x55  # e_machine, of the ELF header
    file.write_bytes(code)
    words = refusal(file)
    assert f"(it is not made for this processor, {platform.machine()}); see to that" in words


def test_a_text_and_a_folder_are_told_as_the_loader_tells_them(tmp_path: Path) -> None:
    text = tmp_path / "libHD.so"
    text.write_text("moved to /opt/OpenHaptics\n")
    assert "(/" in refusal(text)
    assert "file too short" in refusal(text)
    text.write_text("moved to /opt/OpenHaptics\n" * 100)
    assert "invalid ELF header" in refusal(text)
    assert "irectory" in refusal(tmp_path)


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may read all")
def test_a_library_that_may_not_be_read_is_told_so(tmp_path: Path) -> None:
    file = make_library(tmp_path, "maker")
    file.chmod(0)
    assert "Permission denied" in refusal(file)
