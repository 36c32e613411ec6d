"""What is told of mutants: kills by package and tier, survivors, and what has changed."""

from __future__ import annotations

from typing import Any

from mutants import PACKAGES, comparison, package_of, summary

PATH = "shared/cohaptic/control/law.py"


def results(**states: str) -> dict[str, dict[str, Any]]:
    """Mutants on one line each, by their states."""
    return {
        name: {
            "path": PATH,
            "line": line,
            "before": "a <\nb",
            "after": "",
            "tiers": {"fast": {"state": state, "by": "", "tests": 1, "left_out": 0}},
        }
        for line, (name, state) in enumerate(states.items(), 1)
    }


def test_every_state_is_counted_and_whoever_is_not_killed_is_named() -> None:
    said = list(summary(results(a="killed", b="survived", c="unreached")))
    assert said[0] == "tier fast: killed, of mutants"
    assert said[1].split()[:4] == ["control", "1", "of", "3,"]
    assert f"  {PATH}:2: a < b -> nothing" in said
    assert f"  {PATH}:3: a < b -> nothing (unreached)" in said
    assert not any(f"{PATH}:1:" in line for line in said)


def test_two_files_are_compared_by_the_mutants_that_both_have() -> None:
    before = results(a="killed", b="survived", c="survived", old="killed")
    now = results(a="survived", b="killed", c="survived", new="killed")
    said = list(comparison(before, now))
    assert said[0] == "3 mutants are in both"
    assert said[1] == "tier fast: killed before 1, killed now 1, of 3"
    assert [line.split(":")[0].strip() for line in said[2:]] == ["newly killed", "killed no more"]


def test_the_core_has_packages_and_the_rest_has_none() -> None:
    assert package_of(PATH) == "control"
    assert {package_of(folder + "x.py") for both in PACKAGES.values() for folder in both} == {
        *PACKAGES
    }
    assert package_of("shared/cohaptic/cli/app.py") == ""
    assert package_of("server/cohaptic_server/cholesky/blocks.pxd") == ""
