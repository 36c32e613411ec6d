from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits

# A busy machine is no failure: no test has a deadline but the suite's own timeout.
settings.register_profile("cohaptic", deadline=None)
settings.load_profile("cohaptic")


@pytest.fixture(autouse=True, scope="session")
def one_thread() -> Iterator[None]:
    """As on the server: small products spread over threads wait for the slowest of them."""
    with threadpool_limits(limits=1):
        yield
