"""/mission_queue: queue missions, read and cancel them."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from mir_sim.errors import ApiError, argument_error
from mir_sim.messages import Response
from mir_sim.mission_queue import PLAIN_FIELDS, ItemState, QueueAction, QueueItem
from mir_sim.resources.call import Call, Handlers
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row, Site

IN_OWN_WORDS = ("state", "message", "description")


@dataclass(frozen=True)
class Shown:
    """An item as the robot's profile lets it show in one kind of answer: "list", "search", "item" or "order"."""

    robot: SimulatedRobot
    item: QueueItem
    kind: str

    def summary(self) -> dict[str, Any]:
        return self.only(self.item.summary())

    def full(self) -> dict[str, Any]:
        return self.only(self.item.full())

    def only(self, usual: dict[str, Any]) -> dict[str, Any]:
        """The usual fields, or those that the profile says, in the robot's words."""
        profile = self.robot.profile
        if self.kind in profile.fields:
            usual = profile.only(self.kind, self.item.full() | self.item.summary())
        return self._in_own_words(usual) if profile.has_words_for_items else usual

    def value(self, name: str) -> Any:
        """One field, shown or not: filters work on what is stored. None for a field that items don't have under this name."""
        if name in PLAIN_FIELDS and name not in IN_OWN_WORDS:
            return self.item.value(name)
        return self._in_own_words(self.item.full() | self.item.summary()).get(name)

    def _in_own_words(self, fields: dict[str, Any]) -> dict[str, Any]:
        profile, item = self.robot.profile, self.item
        mission = self.robot.site.table("/missions").get(item.mission_id)
        own = {
            "state": profile.state_of(item),
            "message": profile.text(item.message),
            "description": profile.description_of(item, mission["name"] if mission else ""),
        }
        return {
            profile.description_field if name == "description" else name: own.get(name, value)
            for name, value in fields.items()
        }


def list_items(call: Call) -> Any:
    robot, kind = call.robot, "list" if call.request.method == "GET" else "search"
    is_plain = not robot.profile.has_words_for_items and kind not in robot.profile.fields
    return robot.queue if is_plain else [Shown(robot, item, kind) for item in robot.queue]


def order(call: Call) -> Response:
    """Queue a mission. Software 2.x also answers with the full item, 3.x only with what the definition says."""
    robot, fields = call.robot, call.fields()
    mission = robot.site.table("/missions").get(fields["mission_id"])
    if mission is None:
        raise argument_error("mission_id")
    parameters: list[Row] = fields.get("parameters", [])
    check_parameters(robot.site, mission["guid"], parameters)
    # As MiR's definition says, without a description of its own an item gets that of its mission.
    description: str = fields["description"] if "description" in fields else mission["description"]
    item = robot.order(
        mission["guid"],
        call.asker,
        message=fields.get("message", ""),
        description=description,
        parameters=parameters,
        priority=fields.get("priority", 0),
        fleet_schedule_guid=fields.get("fleet_schedule_guid", ""),
    )
    usual = item.full() | item.summary() if robot.software.startswith("2.") else item.summary()
    return Response.json_of(robot.profile.order_status, Shown(robot, item, "order").only(usual))


def check_parameters(site: Site, mission_id: str, parameters: list[Row]) -> None:
    """Clients name a parameter by ``input_name`` or by ``id``; robots accept both. An unknown name gives 500 (reported).

    Raises:
        ApiError: 400 when a mission can't be ordered with these values.
    """
    wanted = site.user_parameters(mission_id)
    values: dict[str, Any] = {}
    for parameter in parameters:
        name = parameter.get("input_name") or parameter.get("id")
        if not isinstance(name, str):
            raise argument_error("parameters")
        if name not in wanted:
            raise ApiError(500)
        values[name] = parameter.get("value")
    for name, asked in wanted.items():
        value = values.get(name, asked["value"])
        is_place = asked["id"] in ("position", "marker")
        if value is None or isinstance(value, dict | list) or (is_place and value not in site.table("/positions")):
            raise argument_error(name)


def _item(call: Call, name: str = "id") -> QueueItem:
    item = (
        call.robot.queue.get(int(call.params[name]))
        if call.params[name].isdecimal() and len(call.params[name]) < 16
        else None
    )
    if item is None:
        raise ApiError(404)
    return item


def get_item(call: Call) -> dict[str, Any]:
    return Shown(call.robot, _item(call), "item").full()


def change_item(call: Call) -> dict[str, Any]:
    """Change a pending item. ``cmd`` is accepted and ignored, as its effect isn't documented."""
    item, fields = _item(call), call.changes()
    if item.state is ItemState.PENDING:
        if fields.get("mission_id", item.mission_id) not in call.robot.site.table("/missions"):
            raise argument_error("mission_id")
        item.mission_id = fields.get("mission_id", item.mission_id)
        item.priority = fields.get("priority", item.priority)
    return Shown(call.robot, item, "item").full()


def cancel_item(call: Call) -> None:
    """Abort one item; it stays in the list. Cancelling an ended one succeeds and changes nothing (guess)."""
    call.robot.cancel(_item(call))


def cancel_all(call: Call) -> None:
    call.robot.cancel_all()


def _action_url(item: QueueItem, action: QueueAction) -> str:
    return f"/v2.0.0/mission_queue/{item.id}/actions/{action.id}"


def list_actions(call: Call) -> list[dict[str, Any]]:
    """The actions started so far, as ``[{id, url}]`` (recorded; the definition has one full object)."""
    item = _item(call, "mission_queue_id")
    return [{"id": action.id, "url": _action_url(item, action)} for action in item.actions]


def get_action(call: Call) -> dict[str, Any]:
    item = _item(call, "mission_queue_id")
    for action in item.actions:
        if str(action.id) == call.params["id"]:
            return {
                **asdict(action),
                "message": call.robot.profile.text(action.message),
                "mission_queue_id": item.id,
                "url": _action_url(item, action),
                "allowed_methods": ["GET"],
            }
    raise ApiError(404)


HANDLERS: Handlers = {
    ("get", "/mission_queue"): list_items,
    ("post", "/mission_queue"): order,
    ("delete", "/mission_queue"): cancel_all,
    ("get", "/mission_queue/{id}"): get_item,
    ("put", "/mission_queue/{id}"): change_item,
    ("delete", "/mission_queue/{id}"): cancel_item,
    ("get", "/mission_queue/{mission_queue_id}/actions"): list_actions,
    ("get", "/mission_queue/{mission_queue_id}/actions/{id}"): get_action,
}
