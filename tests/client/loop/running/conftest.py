from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.client.loop.running.rigs import Parent


@pytest.fixture
def parent() -> Iterator[Parent]:
    made = Parent()
    yield made
    made.memory.close(remove=True)
