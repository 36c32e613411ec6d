"""Tables of the configuration file that concern the whole server."""

from __future__ import annotations

import ipaddress
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from cohaptic_server.guard.proxies import NETWORK, network_of


def _network(said: str) -> str:
    try:
        return network_of(said)
    except ValueError:
        raise ValueError(NETWORK) from None


def _address(said: str) -> str:
    try:
        return str(ipaddress.ip_address(said.strip("[]")))
    except ValueError:
        raise ValueError("an address: 127.0.0.1") from None


class Table(BaseModel):
    """A table of the configuration file; where a text is expected, a number is accepted as well."""

    model_config = ConfigDict(extra="forbid", frozen=True, coerce_numbers_to_str=True)


class AccessTable(Table):
    """Access control; names and meanings are as for the options of `cohaptic serve`.

    Without `state`, bans and used tokens are stored only for as long as the server runs.

    A proxy has to do TLS, since the server has to read the name of the room from the request, in
    plain text, before it hands the connection to a process.
    """

    keys: Path | None = None
    insecure_key_file: bool = False
    open: bool = False
    single_use: bool = False
    session_valid: str | None = None
    insecure: bool = False
    state: Path | None = None
    # Both the front and the rooms use the proxies to find the sources of connections.
    trust_proxy: tuple[Annotated[str, AfterValidator(_network)], ...] = ()


class AdminTable(Table):
    """Configuration of the admin port, as for `--admin`.

    Args:
        port: TCP port, 0 for any free one; None for no admin port.
        host: Address to listen on. Anybody who can connect to this address can read the names and
            delays of all users.
    """

    port: int | None = Field(default=None, ge=0, le=65535)
    host: Annotated[str, AfterValidator(_address)] = "127.0.0.1"
