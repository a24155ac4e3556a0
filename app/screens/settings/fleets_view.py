"""Texts and values that Settings shows of fleets and of the robots that they have. Pure functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from app.domain.models import ANY_VEHICLE, Fleet, FleetKind, Robot
from app.domain.robot import FleetIdentity, Vehicle
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.problems import words_of
from app.screens.common.robot_groups import robots_in_words
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.view import NoticeView, done, machine_phrase
from app.services.robots.fleets import FoundVehicle
from app.widgets.items import Action, Item

ICON = "server-network"


def kind_names() -> dict[FleetKind, str]:
    return {FleetKind.CLASSIC: _("MiR Fleet"), FleetKind.ENTERPRISE: _("Fleet Enterprise")}


def fleet_items(facts: SettingsFacts, check_ups: Mapping[int, NoticeView], chosen: int | None = None) -> list[Item]:
    """A row per fleet, with what has to be done there; ``check_ups``: how they stand, by fleet."""
    return [_fleet_item(facts, fleet, check_ups.get(fleet.id, NoticeView()), chosen) for fleet in facts.fleets]


def _fleet_item(facts: SettingsFacts, fleet: Fleet, check_up: NoticeView, chosen: int | None) -> Item:
    robots, problem = facts.robots_of(fleet), _problem(fleet, check_up)
    return Item(
        ("fleet", fleet.id),
        fleet.name,
        " · ".join((kind_names()[fleet.kind], robots_in_words(robots) if robots else formats.address(fleet.address))),
        problem.text,
        icon=ICON,
        tone=problem.tone,
        look="chosen" if fleet.id == chosen else "plain",
        meta_tone=problem.tone,
        meta_icon=problem.icon,
        actions=(Action("open", icon="chevron-right"),),
    )


def _problem(fleet: Fleet, check_up: NoticeView) -> NoticeView:
    """The first thing that an integrator has to do there."""
    if fleet.needs_password:
        return NoticeView(_("Needs a password"), tone="attention", icon="key-alert-outline")
    if not fleet.enabled:
        return NoticeView(_("Off"), tone="offline")
    if check_up.tone in ("fault", "attention", "accent"):
        return check_up
    if fleet.known is None:
        return NoticeView(_("Not checked up"), tone="attention", icon="clipboard-check-outline")
    if not fleet.is_identified:
        return NoticeView(_("Give the app its own user at the fleet"), tone="attention", icon="account-alert-outline")
    return NoticeView()


def fleet_note(facts: SettingsFacts, fleet: Fleet, check_up: NoticeView) -> NoticeView:
    """What has to be done there, what it is, and its robots that are in the plan."""
    problem, robots = _problem(fleet, check_up), facts.robots_of(fleet)
    names = ", ".join(robot.name for robot in robots) or _("none yet")
    text = problem.text or _("In use here: {robots}").format(robots=names)
    software = fleet.software and _("software {version}").format(version=fleet.software)
    note = " · ".join(part for part in (kind_names()[fleet.kind], software, problem.text and names) if part)
    return NoticeView(text, note, problem.tone, problem.icon or ICON)


def fleet_found(said: FleetIdentity) -> NoticeView:
    """Which fleet answered."""
    robots = len(said.vehicles)
    text = ngettext("The fleet answers, with {n} robot", "The fleet answers, with {n} robots", robots).format(n=robots)
    return done(text, (said.software and _("software {version}").format(version=said.software)) or "")


# ---------------------------------------------------------------------- its robots
def vehicle_items(found: Sequence[FoundVehicle], robots: Sequence[Robot], fleet: Fleet) -> list[Item]:
    """A row per robot that the fleet has, first that for any of them; ``robots`` of the plan can't be added again."""
    added = {robot.vehicle for robot in robots if robot.fleet is not None and robot.fleet.id == fleet.id}
    return [_vehicle_item(each, is_added=each.vehicle.id in added) for each in found]


def _vehicle_item(found: FoundVehicle, *, is_added: bool) -> Item:
    vehicle, is_any = found.vehicle, found.vehicle.id == ANY_VEHICLE
    return Item(
        vehicle.id,
        _("Any robot of the fleet") if is_any else vehicle.name or vehicle.id,
        _("The fleet chooses the robot") if is_any else machine_phrase(vehicle.model, vehicle.serial_number, None),
        _("Added") if is_added else "",
        icon="robot" if is_any else "robot-outline",
        tone="attention" if found.others else "neutral",
        note=words_of(found.warning),
        opens=False,
        actions=() if is_added else (Action("add", _("Add")),),
    )


def to_be_added(found: Sequence[FoundVehicle], robots: Sequence[Robot], fleet: Fleet) -> list[Vehicle]:
    """All that can be added without a warning."""
    added = {robot.vehicle for robot in robots if robot.fleet is not None and robot.fleet.id == fleet.id}
    return [each.vehicle for each in found if not each.others and each.vehicle.id not in added]
