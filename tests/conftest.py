from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(autouse=True, scope="session")
def one_thread() -> Iterator[None]:
    """As on the server: small products spread over threads wait for the slowest of them."""
    with threadpool_limits(limits=1):
        yield
