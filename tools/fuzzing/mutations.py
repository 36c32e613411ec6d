"""Faults in bytes, as cut transfers, bad disks and careless programs make them.

A third of the places are drawn near the start of a piece: there are the counts and the offsets,
which decide more than the thousand coordinates that follow. In text, half of the blocks are whole
lines or tags, so that a reader gets beyond the syntax.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from random import Random

from fuzzing.drafts import Draft

_NEAR = 256  # bytes at the start of a piece, where `_EARLY` of the places are drawn
_EARLY = 1 / 3
_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_END = re.compile(rb"\n|>")
_FEW = 24  # numbers of a text that count as near its start
# Numbers at the limits of types and of sense.
VALUES = (0, -1, float("nan"), float("inf"), 1e38, 2**31, 2**32 - 1)
_TEXTS = (b"0", b"-1", b"nan", b"inf", b"1e38", b"2147483648", b"4294967295")
LONGEST = 200_000  # bytes that repeating a block may add
_MAX_BITS = 8  # bits or bytes that one mutation changes

Mutation = Callable[[bytes, Random], bytes]


def _place(data: bytes, draw: Random) -> int:
    """A place in the data, from 0 to its length."""
    return draw.randint(0, min(_NEAR, len(data)) if draw.random() < _EARLY else len(data))


def _ends(data: bytes) -> list[int]:
    """Places between the lines or tags of a text; none in other data."""
    if b"\0" in data:
        return []
    return [match.end() for match in _END.finditer(data)]


def _places(data: bytes, draw: Random, count: int) -> list[int]:
    """So many places, sorted, near and far: ends of lines or tags, or any."""
    ends = _ends(data) if draw.random() < 0.5 else []
    found = [draw.choice(ends) if ends else _place(data, draw)]
    for _ in range(count - 1):
        if ends:
            further = ends.index(found[-1]) + int(2.0 ** draw.uniform(0.0, 6.0))
            found.append(ends[min(further, len(ends) - 1)])
        else:
            further = int(2.0 ** draw.uniform(0.0, len(data).bit_length()))
            found.append(min(found[-1] + further, len(data)))
    return found


def truncate(data: bytes, draw: Random) -> bytes:
    """Cut the end off."""
    return data[: _place(data, draw)]


def flip_bits(data: bytes, draw: Random) -> bytes:
    """Flip a few single bits."""
    changed = bytearray(data)
    for _ in range(draw.randint(1, _MAX_BITS)):
        at = min(_place(data, draw), len(data) - 1)
        changed[at] ^= 1 << draw.randrange(8)
    return bytes(changed)


def set_bytes(data: bytes, draw: Random) -> bytes:
    """Set a few neighbouring bytes at random."""
    start = _place(data, draw)
    drawn = draw.randbytes(draw.randint(1, _MAX_BITS))
    return data[:start] + drawn + data[start + len(drawn) :]


def repeat_block(data: bytes, draw: Random) -> bytes:
    """Put a block in once more behind itself; one of four times as often as `LONGEST` allows."""
    start, end = _places(data, draw, 2)
    largest = LONGEST // max(1, end - start) if draw.random() < 0.25 else 1
    times = int(2.0 ** draw.uniform(0.0, max(1, largest).bit_length() - 1))
    return data[:end] + data[start:end] * times + data[end:]


def delete_block(data: bytes, draw: Random) -> bytes:
    """Leave a block out."""
    start, end = _places(data, draw, 2)
    return data[:start] + data[end:]


def swap_blocks(data: bytes, draw: Random) -> bytes:
    """Let two neighbouring blocks change places."""
    start, middle, end = _places(data, draw, 3)
    return data[:start] + data[middle:end] + data[start:middle] + data[end:]


def set_number_of_text(data: bytes, draw: Random) -> bytes:
    """Put a number at a limit in place of a number that the text has."""
    found = list(_NUMBER.finditer(data))
    if not found:
        return set_bytes(data, draw)
    taken = draw.choice(found[:_FEW] if draw.random() < _EARLY else found)
    return data[: taken.start()] + draw.choice(_TEXTS) + data[taken.end() :]


def set_number_of_bytes(data: bytes, draw: Random) -> bytes:
    """Write a number at a limit over some bytes, as one of several types in either order."""
    order, start = draw.choice("<>"), _place(data, draw)
    value = draw.choice(VALUES)
    kinds = "fd" if value != value or value in (float("inf"), 1e38) else "fdiqH"
    kind = draw.choice(kinds)
    size = struct.calcsize(f"{order}{kind}")
    if kind in "fd":
        drawn = struct.pack(f"{order}{kind}", value)
    else:
        drawn = (int(value) % 2 ** (8 * size)).to_bytes(size, "little" if order == "<" else "big")
    return data[:start] + drawn + data[start + size :]


MUTATIONS: dict[str, Mutation] = {
    "truncate": truncate,
    "flip": flip_bits,
    "bytes": set_bytes,
    "repeat": repeat_block,
    "delete": delete_block,
    "swap": swap_blocks,
    "number": set_number_of_text,
    "binary": set_number_of_bytes,
}
# Numbers and bits leave most of the syntax as it is.
_WEIGHTS = (1, 3, 1, 2, 2, 2, 5, 3)
_WHOLE = 0.2  # share of packed files that are mutated as they lie on the disk
_MORE = 0.3  # probability of one more mutation, up to `_LARGEST`
_LARGEST = 4


def mutated(draft: Draft, draw: Random) -> tuple[Draft, tuple[str, ...]]:
    """A draft with one to four faults, and their names."""
    if draw.random() < _WHOLE:
        draft = draft.whole()
    names: list[str] = []
    while not names or (len(names) < _LARGEST and draw.random() < _MORE):
        index = draw.randrange(len(draft.pieces))
        piece = draft.pieces[index]
        if not piece:
            names.append("empty")
            continue
        (name,) = draw.choices(list(MUTATIONS), _WEIGHTS)
        draft = draft.changed(index, MUTATIONS[name](piece, draw))
        names.append(name)
    return draft, tuple(names)
