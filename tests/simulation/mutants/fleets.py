"""Bugs to be planted in the code of fleets alone, each with a story that is true without it."""

from __future__ import annotations

from dataclasses import dataclass

from app.mir.errors import Rejected
from tests.services.story import *
from tests.simulation.mutants.mutant import Patch

CLASSIC, ENTERPRISE = "mir.classic_vehicle:ClassicVehicle", "mir.enterprise_vehicle:EnterpriseVehicle"
CUT_OFF = do(lambda s: s.fleet.cut_off({"R1"}))
HEARD_AGAIN = do(lambda s: s.fleet.cut_off(set()))
WITHOUT_CONTACT = [CUT_OFF, 60, plan(), 400, sent(), HEARD_AGAIN, 300, ends(DONE)]
TOKEN = "7c9e6679-7425-40de-944b-e07fc1f90ae7"
ORDER_TWICE = [do(lambda s: s.container.make_client(s.robot("R1")).enqueue(GUIDS["Deliver"], description=TOKEN))] * 2
OWN_USERS = do(lambda s: s.stranger_queues(user="distributor"))
STRANGERS = do(lambda s: s.noted.append(s.stranger_queues()))
CANCEL_UNDER_THAT_NUMBER = do(lambda s: s.container.make_client(s.robot("R1")).cancel(s.noted[-1], "a token of ours"))


@dataclass(frozen=True)
class FleetMutant(Patch):
    """``kind``: of the fleet in the ``story``."""

    kind: str
    story: list
    token_field: str | None = "description"

    def as_story(self) -> Story:
        return Story(self.name, *self.story, target=self.kind, token_field=self.token_field, stays_open=True)


MUTANTS = (
    FleetMutant(
        "Fleet Enterprise is not asked for an order before it is sent again",
        f"{ENTERPRISE}.items_after",
        "for token in tokens:",
        "for token in ():",
        "enterprise",
        [plan(), post(ANSWER_LOST), 900, sent(300), ends(DONE), runs(1)],
    ),
    FleetMutant(
        "an order that Fleet Enterprise has already is a failed start",
        f"{ENTERPRISE}.enqueue",
        "error.status != 409 or",
        "True or",
        "enterprise",
        [ORDER_TWICE, 300, runs(1)],
    ),
    FleetMutant(
        "orders of before a start count as that start's where descriptions don't come back",
        f"{CLASSIC}.items_after",
        "self._queue.items_after(id_floor,",
        "self._queue.items_after(0,",
        "classic",
        [10, OWN_USERS, 200, plan(), post(LOST), 900, ends(DONE), runs(2)],
        token_field=None,
    ),
    FleetMutant(
        "another client's order that has the number of one of ours is cancelled",
        f"{CLASSIC}._check_order",
        "if not is_ours:",
        "if False:",
        "classic",
        [10, STRANGERS, refused(CANCEL_UNDER_THAT_NUMBER, error=Rejected), 300, items("Done")],
    ),
    FleetMutant(
        "clearing a fleet robot's queue clears the orders of others",
        "mir.fleet_target:FleetTarget.clear_queue",
        "for queue_id, token in (own or {}).items():",
        'for queue_id, token in self._send("DELETE", "/mission_scheduler") and ():',
        "classic",
        [
            plan(window=60),
            295,
            stranger(count=2),
            30,
            states(QUEUED),
            clear_queue(),
            300,
            items("Done", "Done", "Aborted"),
        ],
    ),
    FleetMutant(
        "of a robot that its classic fleet doesn't reach the last status counts",
        "mir.fleet_vocabulary:has_contact",
        'return parse.int_or_none(listed.get("fleet_state")) in _FLEET_STATES',
        "return True",
        "classic",
        WITHOUT_CONTACT,
    ),
    FleetMutant(
        "of a robot that Fleet Enterprise doesn't reach the last status counts",
        f"{ENTERPRISE}._check_contact",
        "if not text or is_old or mono - since > SILENT_AFTER:",
        "if not text:",
        "enterprise",
        WITHOUT_CONTACT,
    ),
)
