from __future__ import annotations

import asyncio

import pytest

from cohaptic.errors import CohapticError
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.spring import Spring
from tests.server.shell.stage import names, serving, visit

pytestmark = pytest.mark.live


def test_what_an_administrator_has_ordered_holds_for_the_next_object(
    small_balloon: Balloon,
) -> None:
    def fails() -> Body:
        raise CohapticError("there is none")

    async def happen() -> None:
        name = next(names)
        async with serving(small_balloon) as served:
            server = served.server
            async with visit(served.url) as client:
                member = server.room.members[await client.join(name)]
                # As `moderate` does.
                server.room.muted.add(name, member.claim)
                server.room.frozen, server.room.force_budget = True, 3.0
            for build in (Spring, fails):
                try:
                    await server.exchange(build, lambda _: None)
                except CohapticError:
                    assert build is fails
                room = server.room
                assert isinstance(room.body, Spring)
                assert (room.frozen, room.force_budget) == (True, 3.0)
                async with visit(served.url) as client:
                    assert room.members[await client.join(name)].muted

    asyncio.run(happen())
