"""The authoritative server: at each tick, computes one body under the forces of all users.

A public name is imported from its module when it is first used.

Terms:
    room: One body with all users who touch it and all watchers who look on.
    user: Participant who touches the body with a hand or a device.
    watcher: Participant who receives the state of a room and does not touch.
    tick: One step of the simulation; it lasts `ServerSettings.simulation_period` [s].
    load: Force of one user on the body [N], with its shares on the vertices under the contact.
    patch: Surface near one user's probe without this user's own dent, as the client receives it.
    column: Displacement of all vertices by 1 N on one vertex (a discrete Green's function) [m/N].
    route: Service that a package adds to the server of one room, such as a port of its own.
    kernel: Module with loops over arrays, compiled if a compiler is available.
"""

from typing import TYPE_CHECKING

from cohaptic.compiled import use
from cohaptic.lazy import lazy_names

use("kernels")  # has to precede the import of the first kernel

if TYPE_CHECKING:
    from cohaptic_server.bodies.balloon.balloon import Balloon as Balloon
    from cohaptic_server.bodies.balloon.balloon import BalloonSettings as BalloonSettings
    from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon as RubberBalloon
    from cohaptic_server.bodies.body import Body as Body
    from cohaptic_server.bodies.body import DenseResponse as DenseResponse
    from cohaptic_server.bodies.body import Load as Load
    from cohaptic_server.bodies.body import Response as Response
    from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid as RubberSolid
    from cohaptic_server.bodies.solid.shape import SolidSettings as SolidSettings
    from cohaptic_server.bodies.solid.solid import Solid as Solid
    from cohaptic_server.bodies.spring import Spring as Spring
    from cohaptic_server.bodies.spring import SpringSettings as SpringSettings
    from cohaptic_server.bodies.viscous import Viscous as Viscous
    from cohaptic_server.mesh.surface import SurfaceMesh as SurfaceMesh
    from cohaptic_server.mesh.tetrahedra import TetMesh as TetMesh
    from cohaptic_server.objects.catalogue import build_body as build_body
    from cohaptic_server.objects.object_file import ObjectFile as ObjectFile
    from cohaptic_server.room.room import Room as Room
    from cohaptic_server.routes import Route as Route
    from cohaptic_server.routes import Serving as Serving
    from cohaptic_server.settings import ServerSettings as ServerSettings
    from cohaptic_server.shell.endpoint import Endpoint as Endpoint
    from cohaptic_server.shell.served_room import RoomHand as RoomHand
    from cohaptic_server.shell.served_room import ServedRoom as ServedRoom
    from cohaptic_server.shell.served_room import serve as serve
    from cohaptic_server.shell.server import CohapticServer as CohapticServer
    from cohaptic_server.shell.verification import Verdict as Verdict
    from cohaptic_server.shell.verification import verify_session as verify_session
    from cohaptic_server.testing.check_body import check_body as check_body
    from cohaptic_server.world.equilibrium import Equilibrium as Equilibrium
    from cohaptic_server.world.equilibrium import RestingHand as RestingHand

__all__ = [
    "Balloon",
    "BalloonSettings",
    "Body",
    "CohapticServer",
    "DenseResponse",
    "Endpoint",
    "Equilibrium",
    "Load",
    "ObjectFile",
    "Response",
    "RestingHand",
    "Room",
    "RoomHand",
    "Route",
    "RubberBalloon",
    "RubberSolid",
    "ServedRoom",
    "ServerSettings",
    "Serving",
    "Solid",
    "SolidSettings",
    "Spring",
    "SpringSettings",
    "SurfaceMesh",
    "TetMesh",
    "Verdict",
    "Viscous",
    "build_body",
    "check_body",
    "serve",
    "verify_session",
]

# The module that defines each public name.
_HOMES = {
    "check_body": "cohaptic_server.testing.check_body",
    "RoomHand": "cohaptic_server.shell.served_room",
    "ServedRoom": "cohaptic_server.shell.served_room",
    "serve": "cohaptic_server.shell.served_room",
    "Balloon": "cohaptic_server.bodies.balloon.balloon",
    "BalloonSettings": "cohaptic_server.bodies.balloon.balloon",
    "RubberBalloon": "cohaptic_server.bodies.balloon.rubber_balloon",
    "Body": "cohaptic_server.bodies.body",
    "DenseResponse": "cohaptic_server.bodies.body",
    "Load": "cohaptic_server.bodies.body",
    "Response": "cohaptic_server.bodies.body",
    "RubberSolid": "cohaptic_server.bodies.rubber_solid.rubber_solid",
    "SolidSettings": "cohaptic_server.bodies.solid.shape",
    "Solid": "cohaptic_server.bodies.solid.solid",
    "Spring": "cohaptic_server.bodies.spring",
    "SpringSettings": "cohaptic_server.bodies.spring",
    "Viscous": "cohaptic_server.bodies.viscous",
    "SurfaceMesh": "cohaptic_server.mesh.surface",
    "TetMesh": "cohaptic_server.mesh.tetrahedra",
    "build_body": "cohaptic_server.objects.catalogue",
    "ObjectFile": "cohaptic_server.objects.object_file",
    "Room": "cohaptic_server.room.room",
    "Route": "cohaptic_server.routes",
    "Serving": "cohaptic_server.routes",
    "ServerSettings": "cohaptic_server.settings",
    "Endpoint": "cohaptic_server.shell.endpoint",
    "CohapticServer": "cohaptic_server.shell.server",
    "Equilibrium": "cohaptic_server.world.equilibrium",
    "RestingHand": "cohaptic_server.world.equilibrium",
    "Verdict": "cohaptic_server.shell.verification",
    "verify_session": "cohaptic_server.shell.verification",
}

if not TYPE_CHECKING:  # otherwise a type checker would accept any name
    __getattr__, __dir__ = lazy_names(globals(), _HOMES)
