from __future__ import annotations

import asyncio
import threading

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.bodies.green import (
    GreenSource,
    encode_block,
    green_source,
)
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats
from cohaptic_server.shell.http import GreenBlocks
from cohaptic_server.testing.blocks import block
from tests.patience import PATIENCE

pytestmark = pytest.mark.live


def solid(young: float = 2e4) -> Solid:
    """A small one, held at the bottom."""
    tets = block((0.1, 0.08, 0.06), (3, 3, 2))
    held = tets.vertices[:, 2] < 0.005
    return Solid(tets, held, SolidSettings(young=young, contact_radius=0.02))


@pytest.mark.parametrize("kind", ["balloon", "solid"])
def test_the_response_is_the_sum_of_green_functions(kind: str, small_balloon: Balloon) -> None:
    body: Body = small_balloon if kind == "balloon" else solid()
    source = green_source(body)
    assert source is not None
    rng = np.random.default_rng(5)
    n = len(body.mesh.vertices)
    vertices = rng.choice(n, 6, replace=False)
    weights = rng.random(6)
    weights /= weights.sum()
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    want = body.respond([Load(vertices, weights, direction, 2.5)]).displacement
    got = np.zeros((n, 3))
    for vertex, weight in zip(vertices.tolist(), weights.tolist(), strict=True):
        got += weight * np.tensordot(2.5 * direction, source.green(vertex), axes=1)
    # A solid keeps its columns in single precision.
    close = 1e-9 if kind == "balloon" else 1e-6
    assert np.abs(got - want).max() <= close * np.abs(want).max() + 1e-15


class Held:
    """A source that answers when it is allowed to."""

    def __init__(self, source: GreenSource) -> None:
        self._source = source
        self.allowed = threading.Event()
        self.asked: list[int] = []
        self.at_once = 0
        self.max_at_once = 0

    @property
    def mesh(self) -> SurfaceMesh:
        return self._source.mesh

    def green(self, vertex: int) -> Floats:
        self.asked.append(vertex)
        self.at_once += 1
        self.max_at_once = max(self.max_at_once, self.at_once)
        assert self.allowed.wait(PATIENCE)
        self.at_once -= 1
        return self._source.green(vertex)

    def identity(self) -> bytes:
        return self._source.identity()


def test_blocks_are_solved_once_beside_the_loop_and_kept(small_balloon: Balloon) -> None:
    source = green_source(small_balloon)
    assert source is not None
    held = Held(source)

    async def play() -> None:
        blocks = GreenBlocks(lambda vertex: encode_block(held.green(vertex)))
        asking = [asyncio.ensure_future(blocks.block(v, PATIENCE)) for v in (1, 2, 1, 3)]
        # The loop goes on while the first is being solved.
        for _ in range(20):
            await asyncio.sleep(0)
        assert not any(task.done() for task in asking)
        assert await blocks.block(1, 0.0) is None  # whoever has no patience
        held.allowed.set()
        found = await asyncio.gather(*asking)
        assert found == [encode_block(source.green(v)) for v in (1, 2, 1, 3)]
        assert await blocks.block(1, 0.0) == found[0]
        assert await blocks.blocks((3, 1), 0.0) == b"".join(
            encode_block(source.green(v)) for v in (3, 1)
        )
        assert blocks.solved == 3
        assert await blocks.blocks((3, 4), 0.0) is None  # one of them is not there yet
        blocks.close()

    asyncio.run(play())
    assert sorted(held.asked) == [1, 2, 3]
    assert held.max_at_once == 1


def test_what_waits_and_what_is_kept_is_bounded(small_balloon: Balloon) -> None:
    source = green_source(small_balloon)
    assert source is not None
    held = Held(source)
    size = len(encode_block(source.green(0)))

    async def play() -> None:
        blocks = GreenBlocks(lambda vertex: encode_block(held.green(vertex)), kept_bytes=3 * size)
        asking = [asyncio.ensure_future(blocks.block(v, PATIENCE)) for v in range(144)]
        for _ in range(20):
            await asyncio.sleep(0)
        assert [task.done() for task in asking] == [False] * 128 + [True] * 16
        held.allowed.set()
        found = await asyncio.gather(*asking)
        assert sum(block is None for block in found) == 16
        assert await blocks.block(127, PATIENCE) is not None
        assert blocks.solved == 128  # among the last three
        await blocks.block(0, PATIENCE)
        assert blocks.solved == 129  # gone meanwhile
        blocks.close()

    asyncio.run(play())


def test_who_waits_for_a_body_that_is_exchanged_is_told(small_balloon: Balloon) -> None:
    source = green_source(small_balloon)
    assert source is not None
    held = Held(source)

    async def play() -> None:
        blocks = GreenBlocks(lambda vertex: encode_block(held.green(vertex)))
        asking = [asyncio.ensure_future(blocks.block(v, PATIENCE)) for v in range(5)]
        left = asyncio.ensure_future(blocks.block(6, PATIENCE))
        while not held.asked:
            await asyncio.sleep(0)
        left.cancel()
        blocks.close()
        assert await blocks.block(7, PATIENCE) is None
        held.allowed.set()
        found = await asyncio.gather(*asking, left, return_exceptions=True)
        assert found[0] is not None  # was being solved
        assert found[1:5] == [None] * 4
        assert isinstance(found[5], asyncio.CancelledError)

    asyncio.run(play())
