"""Builds `cohaptic-client` for pip: the packages that a client needs, of the same sources.

Dependencies and commands are those of `cohaptic` in the `pyproject.toml` above this folder, without
the ones that only a server needs, so that nothing is written down twice.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, Final

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

SHARED: Final = Path(__file__).parents[1] / "shared"
OF_SERVERS: Final = {
    "platformdirs",
    "prometheus-client",
    "pydantic-settings",
    "pyjwt",
    "scipy",
    "segno",
    "threadpoolctl",
    "trimesh",
}
# Of `cohaptic.cli`, what needs one of these.
_COMMANDS_OF_SERVERS: Final = {"stability"}


class MetadataHook(MetadataHookInterface):
    """What hatchling asks for the fields that are `dynamic`."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Fill in dependencies, scripts and entry points."""
        whole = tomllib.loads((SHARED.parent / "pyproject.toml").read_text("utf-8"))["project"]
        metadata["dependencies"] = [
            needed for needed in whole["dependencies"] if _name(needed) not in OF_SERVERS
        ]
        metadata["scripts"] = whole["scripts"]
        ours = {
            group: {
                name: place
                for name, place in points.items()
                if place.startswith(("cohaptic.", "cohaptic_client.", "cohaptic_drivers."))
                and name not in _COMMANDS_OF_SERVERS
            }
            for group, points in whole["entry-points"].items()
        }
        metadata["entry-points"] = {group: points for group, points in ours.items() if points}


class BuildHook(BuildHookInterface[Any]):
    """What hatchling calls before it packs."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the package that both sides share, as Python: the wheel is for every system."""
        for file in sorted((SHARED / "cohaptic").rglob("*")):
            inside = file.relative_to(SHARED)
            if file.suffix in (".py", ".typed") and "_compiled" not in inside.parts:
                build_data["force_include"][str(file)] = inside.as_posix()
        build_data["force_include"][str(SHARED.parent / "LICENSE")] = "cohaptic_client/LICENSE"


def _name(requirement: str) -> str:
    """Return the normalised name of the package that a requirement is for."""
    return re.split(r"[^\w.-]", requirement)[0].replace("_", "-").lower()
