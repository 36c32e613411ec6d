"""A limit on the memory that reading a file may take, where the system can set one.

A mesh file says how many of everything are in it, and readers allocate by its word: 644 bytes of
.msh made one ask for 4 GiB. No check of headers covers all formats, and the system's limit does.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Generator
from pathlib import Path

from cohaptic.errors import BodyError

# Reading text into Python's lists takes about 30 bytes for each of the file.
_PER_BYTE = 64
_LEAST = 2**30  # bytes; libraries map some hundred megabytes when they are imported


@contextlib.contextmanager
def reading_limited(path: Path) -> Generator[None]:
    """Limit the memory of this process, within the block, by the size of a file that is read.

    Only Linux limits it. A limit that is there already and lower stays.

    Args:
        path: The file.

    Raises:
        BodyError: More would have been taken.
    """
    allowed = _LEAST + _PER_BYTE * path.stat().st_size
    try:
        with _address_space(allowed):
            yield
    except MemoryError as error:
        raise BodyError(
            f"{path}: reading it would take more than {allowed / 1e9:.2g} GB; the file has"
            f" {path.stat().st_size:,} bytes, and says or unpacks to far more"
        ) from error


@contextlib.contextmanager
def _address_space(more: int) -> Generator[None]:
    """Allow this process so many bytes of address space beyond those that it has."""
    if sys.platform != "linux":
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    limit = address_space() + more
    if before[0] != resource.RLIM_INFINITY and before[0] <= limit:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def address_space() -> int:
    """Address space of this process [bytes]; Linux only."""
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()
