"""Trusted proxies, and the visitor's address that they report for a connection.

X-Forwarded-For, and Forwarded of RFC 7239, are lists; each proxy appends the address that connected
to it. Anybody can have written the entries before those of trusted proxies, so both lists are read
from the end.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from http import HTTPStatus

from cohaptic_server.guard.sources import UNKNOWN, Refusal, address_of, source_of

_MAX_LINES = 8  # of one header
_MAX_ENTRIES = 32
# An address, with or without quotes and brackets, then optionally a port, which may be obfuscated
# (RFC 7239). An IPv6 address has a port only after brackets.
_NODE = re.compile(
    r'"?(?:\[([0-9A-Fa-f:.]{2,45})\]|([0-9.]{7,15}))(?::[0-9A-Za-z._-]{1,32})?"?'
    r'|"?([0-9A-Fa-f:.]{2,45})"?'
)
_ESCAPED = re.compile(r'\\["\\]')
_PAIR = re.compile(r'(?:[^;"]|"[^"]*")+')
NETWORK = "an address or a network, its first address and its width: 127.0.0.1, 172.18.0.0/16"

Network = ipaddress.IPv4Network | ipaddress.IPv6Network


def network_of(said: str) -> str:
    """Return the canonical form of an address or a network.

    Args:
        said: Address or network, such as 127.0.0.1, [::1] or 172.18.0.0/16.

    Raises:
        ValueError: The text is neither an address nor a network.
    """
    network = _network(said)
    return str(network.network_address if network.num_addresses == 1 else network)


def _network(said: str) -> Network:
    address, slash, width = said.partition("/")
    bare = address.strip("[]").partition("%")[0]
    network = ipaddress.ip_network(f"{bare}{slash}{width}")
    if isinstance(network, ipaddress.IPv6Network) and network.prefixlen >= 96:
        mapped = network.network_address.ipv4_mapped
        if mapped is not None:
            return ipaddress.IPv4Network((mapped, network.prefixlen - 96))
    return network


@dataclass(frozen=True, slots=True)
class Proxies:
    """The trusted proxies of one server.

    Args:
        networks: Networks of the proxies' addresses.
    """

    networks: tuple[Network, ...] = ()

    @classmethod
    def named(cls, said: Sequence[str]) -> Proxies:
        """Make the proxies with these addresses and networks, written as for `network_of`."""
        return cls(tuple(_network(one) for one in said))

    def __contains__(self, source: str) -> bool:
        """Whether a source, as `source_of` names it, is a trusted proxy."""
        if not self.networks:
            return False
        address = address_of(source)
        return address is not None and any(address in network for network in self.networks)

    def source_of(self, host: str) -> str:
        """Return the source of a connection, whose budgets it spends.

        The source of a proxy is its exact address, since other IPv6 addresses in its /64 network do
        not count as the proxy. Other sources are as in `sources.source_of`.

        Args:
            host: Address of the other end, as a socket names it.
        """
        return str(address_of(host)) if host in self else source_of(host)

    def visitor(
        self, proxy: str, forwarded_for: Sequence[str], forwarded: Sequence[str]
    ) -> str | Refusal:
        """Return the source of the visitor behind a proxy: the last listed one that is no proxy.

        Args:
            proxy: Source of the proxy, as `source_of` names it.
            forwarded_for: Values of X-Forwarded-For, in their order.
            forwarded: Values of Forwarded, in their order.

        Returns:
            The source, or a refusal if both lists are present and name different sources. In that
            case one list may come from the visitor, with the proxy passing it on, and the server
            cannot tell which.
        """
        lists = (
            [_host(entry) for entry in _from_the_end(forwarded_for)],
            [_host(_for(entry)) for entry in _from_the_end(forwarded)],
        )
        found = {self._last(hosts, proxy) for hosts in lists if hosts}
        if len(found) > 1:
            why = f"X-Forwarded-For and Forwarded name two addresses: {' and '.join(sorted(found))}"
            return Refusal(
                f"{why}; a proxy has to drop the one it does not write", 5.0, HTTPStatus.BAD_REQUEST
            )
        return found.pop() if found else self._last([], proxy)

    def _last(self, hosts: Sequence[str], proxy: str) -> str:
        furthest = proxy
        for host in hosts:
            source = self.source_of(host)
            if source not in self:
                return source
            furthest = source
        # A visitor at a proxy's address is not counted with that proxy's own connections, and has
        # no rights of this machine, since a forwarded connection may come from anywhere.
        return f"proxy {furthest}"


def _from_the_end(values: Sequence[str]) -> Iterator[str]:
    """Yield the entries of a list, the last one first; commas within quotes do not separate them.

    Quotes are paired from the end, too. A quote that a stranger leaves open then cannot enclose an
    entry that a proxy has added.
    """
    whole = _ESCAPED.sub("_", ",".join(value for value in values[-_MAX_LINES:] if value.strip()))
    if not whole:
        return
    entry = ""
    for piece in reversed(whole.rsplit(",", _MAX_ENTRIES)[-_MAX_ENTRIES:]):
        entry = f"{piece},{entry}" if entry else piece
        if entry.count('"') % 2 == 0:
            yield entry
            entry = ""


def _for(entry: str) -> str:
    """Return the value of `for` in an entry of Forwarded; empty without one or with several."""
    pairs = (pair.partition("=") for pair in _PAIR.findall(entry))
    nodes = [value.strip() for name, _, value in pairs if name.strip().lower() == "for"]
    return nodes[0] if len(nodes) == 1 else ""


def _host(node: str) -> str:
    """Return the address in a node, without quotes, brackets and port; `unknown` if none."""
    match = _NODE.fullmatch(node.strip())
    return UNKNOWN if match is None else match[1] or match[2] or match[3]
