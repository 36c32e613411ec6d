"""Finds the addresses of a server that people can share with other machines. No I/O."""

from __future__ import annotations

import ipaddress
from collections.abc import Collection, Sequence

from cohaptic_server.http.origins import is_of_many

# Listening addresses that stand for all interfaces, with the IP versions that they accept.
ALL_INTERFACES = {"": (4, 6), "0.0.0.0": (4,), "::": (6,)}
PATH = "/v1/hosts"


def hosts_for_others(host: str, names: Sequence[str], found: Collection[str]) -> tuple[str, ...]:
    """Hosts of a server that other machines reach, the best one first; () if there is none.

    Args:
        host: Host that the server listens on.
        names: Further names of the server, from its owner; wildcards are left out.
        found: Addresses of this machine.
    """
    bare = host.strip("[]")
    names = [name for name in names if not is_of_many(name)]
    if bare in ALL_INTERFACES:
        named = [name for name in names if not _is_own(name.strip("[]"))]
        versions = ALL_INTERFACES[bare]
        addresses = sorted((a for a in found if _is_shared(a, versions)), key=lambda a: ":" in a)
        hosts = (*named, *addresses)
    else:
        hosts = () if _is_own(bare) else (*names, bare)
    return tuple(dict.fromkeys(_in_address(one) for one in hosts))


def addresses_for_others(url: str, hosts: Sequence[str]) -> tuple[str, ...]:
    """URLs of a server with each of these hosts in place of its own.

    Args:
        url: URL at which the server listens, such as ws://0.0.0.0:8765.
        hosts: Hosts from `hosts_for_others`.
    """
    scheme, _, rest = url.partition("://")
    port = rest.rpartition(":")[2]
    return tuple(f"{scheme}://{host}:{port}" for host in hosts)


def _in_address(host: str) -> str:
    bare = host.strip("[]")
    return f"[{bare}]" if ":" in bare else bare


def _is_own(host: str) -> bool:
    """Whether a host name or address means the local machine, on every machine."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _is_shared(address: str, versions: Collection[int]) -> bool:
    """Whether other machines can connect to an address; not link-local, which needs a zone too."""
    try:
        known = ipaddress.ip_address(address)
    except ValueError:
        return False
    return known.version in versions and not (
        known.is_loopback or known.is_unspecified or known.is_link_local
    )
