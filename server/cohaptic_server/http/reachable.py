"""Decides which pages may use a server, and finds its addresses for other machines. No I/O.

The origin and the host of a request are checked, so that no foreign page can use the server through
a visitor's browser. A browser names the origin of the page (Origin) and the host that it connects
to (Host). If both are the same, the page is the server's own. The host also has to be one of the
server's own names, since a stranger can make any name point at any address (DNS rebinding).

`hosts_for_others` and `addresses_for_others` find the addresses that people can share.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Collection, Sequence

LOOPBACK = ("127.0.0.1", "::1", "localhost")
_THIS_MACHINE = re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?")
_OWN_NAMES = ("localhost", "127.0.0.1", "[::1]")
_HOST = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:\d{1,5})?")
_OWN_HOST = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:\d+)?", re.IGNORECASE)


def is_own_host(host: str | None, own: str | None, allowed: Collection[str]) -> bool:
    """Check whether the Host header of a request names this server.

    Args:
        host: Host header of the request; None if it is missing, which no browser omits.
        own: Address of this machine that the connection came to; None if it is not known.
        allowed: Further names of the server, without ports; `.lab.example` and `*.lab.example`
            stand for all names below `lab.example`.
    """
    if host is None:
        return False
    match = _HOST.fullmatch(host.lower())
    if match is None:
        return False
    name = match["name"]
    if name in _OWN_NAMES or any(_is_one_of(name, other.lower()) for other in allowed):
        return True
    return own is not None and _address(name.strip("[]")) == _address(own) is not None


def may_connect(
    origin: str | None,
    host: str | None,
    *,
    own: str | None,
    hosts: Collection[str],
    allowed: Collection[str],
) -> bool:
    """Decide whether a page may open a websocket to this server.

    Args:
        origin: Origin header of the request; None from a native client.
        host: Host header of the request; None if it is missing.
        own: Address of this machine that the connection came to; None if it is not known.
        hosts: Further names of the server.
        allowed: Further origins whose pages may connect.
    """
    if origin is None or origin in allowed or _THIS_MACHINE.fullmatch(origin):
        return True
    if host is None or not is_own_host(host, own, hosts):
        return False
    return origin.lower() in (f"http://{host.lower()}", f"https://{host.lower()}")


def is_of_this_machine(
    origin: str | None, host: str | None, peer: str | None, *, allowed: Collection[str]
) -> bool:
    """Check whether a request comes from this machine, and so may do more, such as upload a file.

    The connection must come from this machine, or through a tunnel that ends on this machine. The
    request must come from the server's own page, an allowed origin or a native client. Other pages
    of this machine are refused, and so is a page whose name was made to point at this machine.

    Args:
        origin: Origin header of the request; None from a native client.
        host: Host header of the request; None if it is missing.
        peer: Address of the other end of the connection; None if it is not known.
        allowed: Further origins whose pages are accepted.
    """
    if peer is None or not _is_loopback(peer):
        return False
    if origin is not None and origin in allowed:
        return True
    if host is None or not _OWN_HOST.fullmatch(host):
        return False
    return origin is None or origin.lower() in (f"http://{host.lower()}", f"https://{host.lower()}")


def _is_loopback(peer: str) -> bool:
    address = _address(peer)
    return address is not None and address.is_loopback


def _address(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Parse an IP address; an IPv4-mapped IPv6 address becomes IPv4; None if it is a name."""
    try:
        address = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return None
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return mapped or address


def is_of_many(allowed: str) -> bool:
    """Check whether an allowed host name is a wildcard for many names, which no browser opens."""
    return allowed.startswith((".", "*."))


def _is_one_of(name: str, allowed: str) -> bool:
    if is_of_many(allowed):
        below = allowed.removeprefix("*")
        return name.endswith(below) and name != below
    return name.strip("[]") == allowed.strip("[]")


# Listening addresses that stand for all interfaces, with the IP versions that they accept.
ALL_INTERFACES = {"": (4, 6), "0.0.0.0": (4,), "::": (6,)}
PATH = "/v1/hosts"


def hosts_for_others(host: str, names: Sequence[str], found: Collection[str]) -> tuple[str, ...]:
    """Return the hosts under which other machines reach a server, the best one first.

    Args:
        host: Host that the server listens on.
        names: Further names of the server, from its owner; wildcards are left out.
        found: Addresses of the network interfaces of this machine.
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
    """Return the URLs of a server, with each of these hosts in place of its own.

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
    """Check whether a host name or address is a loopback one, which no other machine can use."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _is_shared(address: str, versions: Collection[int]) -> bool:
    """Check whether other machines can connect to an address of one of these IP versions.

    They cannot use a link-local address, which also needs a zone.
    """
    try:
        known = ipaddress.ip_address(address)
    except ValueError:
        return False
    return known.version in versions and not (
        known.is_loopback or known.is_unspecified or known.is_link_local
    )
