from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.clients_cpp.programs import COMPILERS, Questions, asked, build, compiler


@pytest.fixture(scope="package", params=COMPILERS)
def vectors(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Questions]:
    """The running `vectors.cpp`, made by one compiler and by the other."""
    out = tmp_path_factory.mktemp("cpp") / "vectors"
    with asked(build(compiler(request.param), "tests/vectors.cpp", out)) as questions:
        yield questions
