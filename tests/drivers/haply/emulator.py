"""The Haply service as `devices.md` of the facts describes it, with arms that a force moves.

A websocket server: one full message at first, then exactly one to each that comes. An arm is a
point mass that a simulated hand holds. Alone, as `python -m tests.drivers.haply.emulator
ARMS`, it prints its port and obeys lines of JSON on its standard input.
"""

from __future__ import annotations

import json
import sys
import threading
from dataclasses import dataclass, field
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import Server, ServerConnection, serve

from cohaptic.clock import Clock, SystemClock
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
from cohaptic.simulated.hand import Hand, HandState, move
from cohaptic.vec import ZERO, Vec3

REST: Vec3 = (0.0, 0.15, 0.20)  # m; in the frame of the service
STEP = 0.001  # s; longest step of the mechanics
READY = {
    "calibrated": True, "in_use": False, "power_supply": True, "ready": True, "started": True,
}  # fmt: skip


@dataclass
class EmulatedArm:
    """A device of the service; `goal` is where its hand wants to be."""

    id: str = "049D"
    hand: Hand = field(default_factory=Hand)
    goal: Vec3 = REST
    status: dict[str, bool] = field(default_factory=lambda: dict(READY))
    state: HandState = field(default_factory=lambda: HandState(REST, ZERO))
    force: Vec3 = ZERO
    button: bool = False
    plugged: bool = True
    config: dict[str, Any] = field(default_factory=lambda: {"handedness": "right"})
    transform: dict[str, Any] = field(default_factory=dict[str, Any])

    def advance(self, dt: float) -> None:
        while dt > 1e-9:
            self.state = move(self.state, self.hand, self.goal, self.force, min(dt, STEP))
            dt -= STEP

    def message(self, *, full: bool) -> dict[str, Any]:
        state = {
            "cursor_position": xyz(self.state.position),
            "cursor_velocity": xyz(self.state.velocity),
            "angular_position": {"a0": 0.1, "a1": 0.2, "a2": 0.3},
            "body_orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0},
            "current_cursor_force": xyz(self.force),
            "control_domain": "cartesian",
            "control_mode": "idle",
            "transform": self.transform,
        }
        listed = {"device_id": self.id, "state": state, "status": self.status}
        return listed | ({"config": self.config} if full else {})


class HaplyEmulator:
    """The service on a port of loopback.

    Args:
        arms: Its devices.
        clock: By which arms move; None: by a millisecond with each message, whatever time it is.

    Attributes:
        given: Time, device and force of each command, in order.
        silent: Set: messages are not answered until it is cleared.
        instead: Sent in place of each answer; empty for the true one.
        grips: Whether the button of each is held, by its id; that of any arm holds the first.
    """

    def __init__(self, arms: list[EmulatedArm], clock: Clock | None = None) -> None:
        self.arms = {arm.id: arm for arm in arms}
        self.clock = clock
        self.given: list[tuple[float, str, Vec3]] = []
        self.silent = threading.Event()
        self.instead = ""
        self.grips = {"61548": False}
        self.connections: list[ServerConnection] = []
        self.lock = threading.Lock()
        self._advanced = clock.now() if clock else 0.0
        self._server: Server = serve(self._talk, "127.0.0.1", 0, compression=None)
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    @property
    def port(self) -> int:
        port: int = self._server.socket.getsockname()[1]
        return port

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    def close(self) -> None:
        self.silent.clear()
        for connection in self.connections:
            connection.close()
        self._server.shutdown()
        self._thread.join()

    def drop(self) -> None:
        """Break every connection, as a service that is killed does."""
        for connection in self.connections:
            connection.socket.close()

    def _talk(self, connection: ServerConnection) -> None:
        self.connections.append(connection)
        try:
            connection.send(self._message(full=True))
            for text in connection:
                answer = self._answer(json.loads(text))
                while self.silent.is_set():
                    threading.Event().wait(0.001)
                connection.send(answer)
        except (ConnectionClosed, OSError):
            pass

    def _answer(self, message: dict[str, Any]) -> str:
        with self.lock:
            dt = STEP
            if self.clock is not None:
                now = self.clock.now()
                dt, self._advanced = now - self._advanced, now
            else:
                self._advanced += dt
            for arm in self.arms.values():
                arm.advance(dt)
            for command in message.get("inverse3", []):
                self._obey(command)
        if self.instead:
            return self.instead
        return self._message(full="force_render_full_state" in message.get("session", {}))

    def _obey(self, command: dict[str, Any]) -> None:
        arm = self.arms.get(command["device_id"])
        values = command["commands"].get("set_cursor_force", {}).get("values")
        if arm is None or not arm.plugged or values is None:
            return
        arm.force = (values["x"], values["y"], values["z"])
        self.given.append((self._advanced, arm.id, arm.force))

    def _message(self, *, full: bool) -> str:
        arms = [arm.message(full=full) for arm in self.arms.values() if arm.plugged]
        held = dict(self.grips)
        if any(arm.button for arm in self.arms.values()):
            held["61548"] = True
        grips = [
            {"device_id": name, "state": {"buttons": {"a": button, "b": False}}}
            for name, button in held.items()
        ]
        return json.dumps({"session_id": 7, "inverse3": arms, "wireless_verse_grip": grips})


def xyz(v: Vec3) -> dict[str, float]:
    return {"x": v[0], "y": v[1], "z": v[2]}


def main() -> None:
    """Serve the arms of the command line until standard input ends.

    A line {"goal": [x, y, z]} moves the hands; {"save": PATH} writes what was given, with times
    on the wall's clock.
    """
    prefer_this_process(LOOP_PRIORITY)  # as a service of devices does
    clock = SystemClock()
    emulator = HaplyEmulator([EmulatedArm(name) for name in sys.argv[1:]], clock)
    print(emulator.port, flush=True)
    for line in sys.stdin:
        command = json.loads(line)
        with emulator.lock:
            if "goal" in command:
                for arm in emulator.arms.values():
                    arm.goal = tuple(command["goal"])
            if "save" in command:
                wall = clock.to_wall()
                with open(command["save"], "w") as file:
                    json.dump([(t + wall, *force) for t, _, force in emulator.given], file)
                print("saved", flush=True)
    emulator.close()


if __name__ == "__main__":
    main()
