"""Simulated MiR mobile robots and fleets that answer the same REST APIs as real ones.

>>> robot = SimulatedRobot("Aino", seed=1)
>>> robot.advance_to(60.0)
>>> handle(robot, Request.of("GET", "/api/v2.0.0/status")).json()["state_text"]
'Ready'

``with serve(robots=3) as served:`` serves robots on free ports of this machine, and ``serve(robots=3, fleet="classic")`` a fleet
above them too.

Comments say where behaviour is known from. "Recorded": seen in answers of real robots and fleets. "Reported": described by people
who run robots or write clients for them. "Guess": neither. What follows MiR's definition of the API (``definitions/``) carries no mark.
"""

from mir_sim.api import handle
from mir_sim.exchange import Exchange, Fate, exchange
from mir_sim.fleet import Fleet, FleetRobot, serve
from mir_sim.fleets import make_fleet
from mir_sim.messages import Request, Response
from mir_sim.missions import MISSIONS
from mir_sim.profile import DEVIANTS, Profile, deviant
from mir_sim.robot import SimulatedRobot

__all__ = [
    "DEVIANTS",
    "MISSIONS",
    "Exchange",
    "Fate",
    "Fleet",
    "FleetRobot",
    "Profile",
    "Request",
    "Response",
    "SimulatedRobot",
    "deviant",
    "exchange",
    "handle",
    "make_fleet",
    "serve",
]
