"""A simulated MiR mobile robot that a client of the real one can't tell from it.

>>> robot = SimulatedRobot("Aino", seed=1)
>>> robot.advance_to(60.0)
>>> handle(robot, Request.of("GET", "/api/v2.0.0/status")).json()["state_text"]
'Ready'

``with serve(robots=3) as fleet:`` gives robots on free ports of this machine.
"""
from mir_sim.api import handle
from mir_sim.exchange import Exchange, Fate, exchange
from mir_sim.fleet import Fleet, FleetRobot, serve
from mir_sim.messages import Request, Response
from mir_sim.missions import MISSIONS
from mir_sim.robot import SimulatedRobot

__all__ = ["MISSIONS", "Exchange", "Fate", "Fleet", "FleetRobot", "Request", "Response", "SimulatedRobot", "exchange", "handle", "serve"]
