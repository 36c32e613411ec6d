"""The users of the load, where a server does what it should not."""

from __future__ import annotations

import multiprocessing
import socket
import threading

import load_users


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
            taken[0].close()
            while len(came) < 200:  # the other goes on sending
                came.extend(taken[1].recv(4096))
            taken[1].close()

        came = bytearray()
        serving = threading.Thread(target=serve, daemon=True)
        # Plays until it is told to end.
        playing = threading.Thread(
            target=lambda: load_users.play(theirs, [url, nobody], 2), daemon=True
        )
        serving.start()
        playing.start()
        serving.join(20.0)
        assert not serving.is_alive(), "the user who was left sent no samples"
        ours.send(True)
        assert ours.poll(20.0)
        counts, _, closed = ours.recv()
        assert [patches for patches, _, _ in counts] == [0, 0]
        assert len([words for words in closed if words.startswith(nobody)]) == 2
        assert len(closed) >= 3
        ours.send(False)
        playing.join(20.0)
        assert not playing.is_alive()
