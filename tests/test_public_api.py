"""What is public is said once, and is true."""

from __future__ import annotations

import importlib
import importlib.metadata
import inspect
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import cohaptic
import cohaptic.testing

pytestmark = pytest.mark.live

ROOT = Path(__file__).parents[1]
PACKAGES = ("cohaptic", "cohaptic_server", "cohaptic_client", "cohaptic_experiments")
SOURCES = ("shared", "server", "client", "experiments")


# Who takes a name away or gives it another meaning breaks programs: docs/reference/stable.md.
PUBLIC = {
    "cohaptic": """
        BodyError Clock CloseCode CohapticError DeviceError export_session FixedGains Hand
        HandScript Intention Law LinkSettings LocalProtocolError Place ProtocolError
        read read_recording read_session record Recorder Recording RemoteProtocolError Rhythm
        RoomRecording RoomView Row
        rows_in ServerLost Session SettingError SystemClock TouchStatus view
    """,
    "cohaptic_server": """
        Balloon BalloonSettings Body build_body check_body CohapticServer DenseResponse
        Endpoint Equilibrium Load ObjectFile Response RestingHand Room RoomHand Route
        RubberBalloon RubberSolid serve ServedRoom ServerSettings Serving Solid
        SolidSettings Spring SpringSettings SurfaceMesh TetMesh Verdict verify_session Viscous
    """,
    "cohaptic_client": """
        AddedRule Client ClientSettings Contact Device DeviceChoice DeviceConfig DeviceInfo
        DeviceKind DeviceSample Found join joined LiveHand News Other place Placed
        placed_info PLACING_OPTIONS SimulatedDevice Stream
    """,
    "cohaptic_experiments": """
        Experiment EXPERIMENTS load Options Outcome Scheme VirtualSession VirtualUser
    """,
}


def public_names(package: str) -> list[str]:
    return list(importlib.import_module(package).__all__)


@pytest.mark.parametrize("package", PACKAGES)
def test_the_public_names_are_those_of_the_list(package: str) -> None:
    found = {name for name in public_names(package) if not name.startswith("_")}
    assert found == set(PUBLIC[package].split())


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_exists_and_has_a_docstring(package: str) -> None:
    module = importlib.import_module(package)
    for name in public_names(package):
        value = getattr(module, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__module__.partition(".")[0] == package, name
            assert inspect.getdoc(value), name


def test_a_name_is_public_in_one_package_only() -> None:
    counts = Counter(name for package in PACKAGES for name in public_names(package))
    assert [name for name, count in counts.items() if count > 1] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_type_checkers_and_the_interpreter_find_the_same_names(package: str) -> None:
    """The lazy imports are written twice: once for type checkers, once for `__getattr__`."""
    module = importlib.import_module(package)
    source = inspect.getsource(module)
    declared = dict(
        (name, home)
        for home, name in re.findall(r"^    from (\S+) import (\w+) as \2$", source, re.M)
    )
    assert declared == module._HOMES
    eager = re.findall(r"^from \S+ import \w+ as (\w+)$|^(__version__)", source, re.M)
    assert sorted([*declared, *(a or b for a, b in eager)]) == sorted(public_names(package))


@pytest.mark.parametrize("package", PACKAGES)
def test_an_unknown_name_is_an_attribute_error(package: str) -> None:
    with pytest.raises(AttributeError, match=f"'{package}' has no attribute 'nobody'"):
        _ = importlib.import_module(package).nobody
    assert set(public_names(package)) <= set(dir(importlib.import_module(package)))


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_has_a_page_of_reference(package: str) -> None:
    """mkdocstrings writes the page from `__all__`, so a public name is on it."""
    page = (ROOT / f"docs/reference/{package}.md").read_text()
    assert re.search(rf"^::: {package}$", page, re.M)


def test_modules_inside_the_packages_import_from_where_a_name_is_defined() -> None:
    """Otherwise every import of one module could pull in the whole package."""
    wrong = re.compile(rf"^\s*from ({'|'.join(PACKAGES)}) import (?!__version__)([A-Z]\w*)", re.M)
    for side in SOURCES:
        for path in (ROOT / side).rglob("*.py"):
            assert not wrong.search(path.read_text()), path


def test_the_public_names_of_the_doubles_exist() -> None:
    for name in cohaptic.testing.__all__:
        assert hasattr(cohaptic.testing, name)


def test_the_installed_version_is_the_codes() -> None:
    assert importlib.metadata.version("cohaptic") == cohaptic.__version__
    changelog = (ROOT / "CHANGELOG.md").read_text()
    newest = re.search(r"^## (\S+)", changelog, re.M)
    assert newest is not None
    assert newest[1] == cohaptic.__version__


def test_the_loops_process_starts_without_heavy_libraries() -> None:
    """Its imports are most of its start; the network's would also be the network's delays."""
    code = (
        "import cohaptic_client.loop.running.entry, sys;"
        "print([m for m in ('numpy', 'pydantic', 'asyncio', 'websockets') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_client_starts_without_the_servers_libraries() -> None:
    code = (
        "import cohaptic.cli.app, sys; cohaptic.cli.app.build_app('touch');"
        "print([m for m in ('scipy', 'trimesh', 'cohaptic_server') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_command_line_lists_its_commands_and_its_version() -> None:
    run = [sys.executable, "-m", "cohaptic"]
    shown = subprocess.run([*run, "--help"], capture_output=True, text=True, check=True).stdout
    for command in ("demo", "serve", "touch"):
        assert command in shown
    version = subprocess.run([*run, "--version"], capture_output=True, text=True, check=True)
    assert version.stdout.strip() == f"cohaptic {cohaptic.__version__}"
    unknown = subprocess.run([*run, "dance"], capture_output=True, text=True)
    assert unknown.returncode == 2
    assert "dance" in unknown.stderr
