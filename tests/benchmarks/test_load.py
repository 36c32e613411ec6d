"""The users of the load, where a server does what it should not."""

from __future__ import annotations

import multiprocessing
import socket
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

import load
import load_users

pytestmark = pytest.mark.live


def test_users_who_are_closed_or_refused_are_told_of_and_the_others_go_on() -> None:
    ours, theirs = multiprocessing.Pipe()
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_server(("127.0.0.1", 0)) as gone,
    ):
        url = f"ws://127.0.0.1:{server.getsockname()[1]}/104"
        nobody = f"ws://127.0.0.1:{gone.getsockname()[1]}/104"
        gone.close()

        def serve() -> None:
            taken: list[socket.socket] = []
            for _ in range(2):
                taken.append(server.accept()[0])
                taken[-1].recv(4096)
                taken[-1].sendall(b"HTTP/1.1 101 Switching Protocols\r\n\r\n")
            taken[0].sendall(b"\x88\x07\x03\xe8full!")
            taken[0].close()
            while len(came) < 200:  # the other goes on sending
                came.extend(taken[1].recv(4096))
            taken[1].close()

        came = bytearray()
        serving = threading.Thread(target=serve, daemon=True)
        # Plays until it is told to end.
        playing = threading.Thread(
            target=lambda: load_users.play(theirs, [url, nobody], [2, 2]), daemon=True
        )
        serving.start()
        playing.start()
        serving.join(20.0)
        assert not serving.is_alive(), "the user who was left sent no samples"
        closed: list[str] = []
        for _ in range(100):  # that the first one was closed may be seen later
            ours.send(True)
            assert ours.poll(20.0)
            counts, _, closed = ours.recv()
            assert [patches for patches, _, _ in counts] == [0, 0]
            if len(closed) >= 3:
                break
            threading.Event().wait(0.05)
        assert len([words for words in closed if words.startswith(nobody)]) == 2
        assert len(closed) >= 3
        assert any("full!" in words for words in closed)
        ours.send(False)
        playing.join(20.0)
        assert not playing.is_alive()


@given(st.integers(1, 800), st.integers(1, 64))
def test_users_are_spread_evenly_over_as_few_rooms_as_hold_them(users: int, most: int) -> None:
    each = load.spread(users, most)
    assert sum(each) == users
    assert max(each) <= most
    assert max(each) - min(each) <= 1
    assert (len(each) - 1) * most < users
