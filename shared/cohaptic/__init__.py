"""Shared by server and client: messages, control laws, clocks, errors.

This package imports neither the server nor the client. Its top level stays light, because the
process that runs the 1 kHz loop imports it: names that need pydantic live in their own modules.
"""

from cohaptic.errors import CohapticError as CohapticError
from cohaptic.errors import LocalProtocolError as LocalProtocolError
from cohaptic.errors import RemoteProtocolError as RemoteProtocolError

__version__ = "0.1.0"

__all__ = ["CohapticError", "LocalProtocolError", "RemoteProtocolError", "__version__"]
