"""What stands in `deploy/` fits the program, and its files fit each other."""

from __future__ import annotations

import ipaddress
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer.main
from prometheus_client.parser import text_string_to_metric_families

from cohaptic.cli.app import build_app
from cohaptic_ops.monitoring.exposition import exposition
from cohaptic_ops.rooms.config import load_config
from cohaptic_server.cli.access_options import AccessOptions
from tests.ops.monitoring.some import cluster, health, room, ticking, user

pytestmark = pytest.mark.live

DEPLOY = Path(__file__).parents[2] / "deploy"
RUNBOOK = (DEPLOY.parent / "docs/how-to/operate-a-server.md").read_text()
yaml: Any = pytest.importorskip("yaml")


def metrics() -> set[str]:
    """Names of all families that a server in a cluster tells, as queries name them."""
    line = room(users=(user(),), margin=2.0, limited={"depth": 1}, refused={"x": 1}, spent={"x": 1})
    known = ticking(line)
    known.take(health(cluster=cluster()), 1.0)
    text = exposition(known, 1.0).decode()
    return {
        f"{family.name}_total" if family.type == "counter" else family.name
        for family in text_string_to_metric_families(text)
    }


def named(text: str) -> set[str]:
    """Metrics that a query names, without the suffixes of histograms."""
    found = re.findall(r"cohaptic_\w+", text)
    return {re.sub(r"(?<=seconds)_(bucket|sum|count)$", "", name) for name in found}


def test_queries_of_alerts_and_dashboard_name_metrics_that_there_are() -> None:
    board = json.loads((DEPLOY / "dashboard/cohaptic.json").read_text())
    queries = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    rules = yaml.safe_load((DEPLOY / "alerts.yml").read_text())["groups"][0]["rules"]
    reported = metrics()
    assert len(queries) > 14
    for query in (*queries, *(rule["expr"] for rule in rules)):
        assert named(query) <= reported, query
        assert named(query) or "up{" in query


def test_the_runbook_has_every_metric_and_every_alert() -> None:
    table = RUNBOOK[RUNBOOK.index("## Metrics") : RUNBOOK.index("## Alerts")]
    rows = "\n".join(line for line in table.splitlines() if line.startswith("| `"))
    listed = {f"cohaptic_{name}" for name in re.findall(r"`(\w+)`", rows)}
    assert metrics() <= listed
    assert listed - metrics() <= {"cohaptic_depth", "cohaptic_speed"}
    rules = yaml.safe_load((DEPLOY / "alerts.yml").read_text())["groups"][0]["rules"]
    described = set(re.findall(r"^\| \*\*(\w+)\*\* \|", RUNBOOK, re.M))
    assert {rule["alert"] for rule in rules} == described


def test_the_containers_fit_each_other_and_the_files_beside_them() -> None:
    compose = yaml.safe_load((DEPLOY.parent / "docker-compose.yml").read_text())
    services = compose["services"]
    config = load_config(DEPLOY / "rooms.compose.toml")
    proxy = services["proxy"]["networks"]["inside"]["ipv4_address"]
    assert config.access.trust_proxy == (proxy,)
    # It says itself who comes in and how that is secured, so it starts.
    AccessOptions(open=config.access.open, insecure=config.access.insecure).protection(config.host)
    scrape = yaml.safe_load((DEPLOY / "prometheus.yml").read_text())["scrape_configs"][0]
    (target,) = scrape["static_configs"][0]["targets"]
    host, _, port = target.partition(":")
    assert host in services
    assert host in config.allow_hosts
    assert int(port) == config.admin.port
    assert f":{port}/readyz" in (DEPLOY / "Dockerfile").read_text()
    for name, service in services.items():
        assert set(service.get("depends_on", ())) <= set(services), name
        for volume in service.get("volumes", ()):
            source = volume.split(":")[0]
            if source.startswith("."):
                assert (DEPLOY.parent / source).is_file(), source
            else:
                assert source in compose["volumes"], source
        if service["image"] == "cohaptic":
            understood(service["command"])
    assert "server:8765" in (DEPLOY / "Caddyfile.compose").read_text()
    assert {n for n, s in services.items() if "profiles" in s} == {"prometheus", "grafana"}


def test_nobody_but_the_proxy_is_given_the_address_that_the_server_believes() -> None:
    compose = yaml.safe_load((DEPLOY.parent / "docker-compose.yml").read_text())
    (pool,) = compose["networks"]["inside"]["ipam"]["config"]
    (believed,) = load_config(DEPLOY / "rooms.compose.toml").access.trust_proxy
    address = ipaddress.ip_address(believed)
    assert address in ipaddress.ip_network(pool["subnet"])
    assert address not in ipaddress.ip_network(pool["ip_range"])
    assert ipaddress.ip_address(pool["gateway"]) not in ipaddress.ip_network(pool["ip_range"])


def test_with_keys_nobody_comes_into_the_containers_without_a_token(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    server = yaml.safe_load((DEPLOY / "keys.compose.yml").read_text())["services"]["server"]
    for name, value in server["environment"].items():
        monkeypatch.setenv(name, value)
    access = load_config(DEPLOY / "rooms.compose.toml").access
    (mounted,) = (volume.split(":")[1] for volume in server["volumes"])
    assert (access.open, str(access.keys)) == (False, mounted)


def understood(arguments: list[str]) -> None:
    """Parse a command line as the program does; an option that there is not raises."""
    group: Any = typer.main.get_command(build_app(only=arguments[0]))
    command = group if arguments[0] not in getattr(group, "commands", ()) else None
    command = command or group.commands[arguments[0]]
    command.make_context(arguments[0], list(arguments[1:]))


PROMTOOL, ANALYZE = shutil.which("promtool"), shutil.which("systemd-analyze")


@pytest.mark.skipif(ANALYZE is None, reason="systemd is not installed")
def test_systemd_finds_nothing_wrong(tmp_path: Path) -> None:
    assert ANALYZE is not None
    text = (DEPLOY / "cohaptic.service").read_text()
    unit = tmp_path / "cohaptic.service"
    for wrong, expected in (("", True), ("RestrictEverything=yes\nNoNewPrivileges", False)):
        reported = text.replace("/opt/cohaptic/bin/cohaptic", sys.executable)
        unit.write_text(reported if expected else reported.replace("NoNewPrivileges", wrong))
        done = subprocess.run(
            [ANALYZE, "verify", str(unit)], capture_output=True, text=True, check=False
        )
        assert (done.returncode == 0 and "Unknown" not in done.stderr) is expected, done.stderr


def test_the_manifest_for_kubernetes_names_its_own_pods_and_its_rooms_are_a_configuration(
    tmp_path: Path,
) -> None:
    found = {
        (one["kind"], one["metadata"]["name"]): one
        for one in yaml.safe_load_all((DEPLOY / "kubernetes.yaml").read_text())
    }
    pods = found["StatefulSet", "cohaptic"]["spec"]
    written = tmp_path / "rooms.toml"
    written.write_text(found["ConfigMap", "cohaptic-rooms"]["data"]["rooms.toml"])
    config = load_config(written)
    service = pods["serviceName"]
    names = [f"cohaptic-{k}.{service}" for k in range(pods["replicas"])]
    assert list(config.cluster.witnesses) == names
    assert found["Service", service]["spec"]["clusterIP"] == "None"
    (container,) = pods["template"]["spec"]["containers"]
    words = container["args"]
    understood(words)
    assert words[words.index("--cluster") + 1].partition(":")[0] == names[0]
    ports = {port["name"]: port["containerPort"] for port in container["ports"]}
    assert ports == {"rooms": config.port, "admin": config.admin.port}
    assert found["Service", "cohaptic-front"]["spec"]["ports"][0]["port"] == config.port
    # A secret is mounted where the keys are looked for.
    mounted = [mount["mountPath"] for mount in container["volumeMounts"]]
    assert str(config.access.keys).rpartition("/")[0] in mounted
