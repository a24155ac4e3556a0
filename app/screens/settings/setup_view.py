"""Settings, Set-up: what a new tablet still needs, from what the app knows. Pure functions of the facts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from app.domain.check_up import Level
from app.domain.models import Fleet, Robot, Settings
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.foreseen import wrong_values
from app.screens.common.robot_appearance import silence_word
from app.screens.settings.check_up_view import counts, outdated
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.view import days_phrase
from app.widgets.items import Action, Item

MOST_NAMED = 5  # robots
OPTIONAL = ("favourites", "days", "backup", "pin")


@dataclass(frozen=True)
class Step:
    """``support`` says how it stands, ``action`` is the word of the button that leads to where it is done: to the ``section`` of Settings,
    or another ``screen``, with ``intent``. ``is_wrong``: it was done, and something is wrong now."""

    key: str
    title: str
    support: str
    is_done: bool
    action: str
    section: str
    intent: tuple[tuple[str, Any], ...] = ()
    is_wrong: bool = False
    screen: str = "settings"


def steps(facts: SettingsFacts) -> list[Step]:
    """In the order in which they are best taken, without those that somebody does not want."""
    found = [_robots(facts), _check_ups(facts), *_missions(facts), *_values(facts)]
    found += [_days(facts), _backup(facts), _pin(facts)]
    return [step for step in found if step.is_done or step.key not in facts.steps_left_out]


def _in_use(facts: SettingsFacts) -> list[Robot]:
    return [robot for robot in facts.robots if robot.enabled]


def _named(robots: Sequence[Robot | Fleet]) -> str:
    if len(robots) > MOST_NAMED:
        return ngettext("{n} robot", "{n} robots", len(robots)).format(n=len(robots))
    return ", ".join(robot.name for robot in robots) or _("none yet")


def _robots(facts: SettingsFacts) -> Step:
    robots = _in_use(facts)
    never = [robot for robot in robots if robot.identified_by is None]
    silent = (
        []
        if never
        else [(robot, word) for robot in robots if (word := silence_word(facts.snapshot(robot.id).connection))]
    )
    support = _("Not yet: {robots}").format(robots=_named(never)) if never else _named(robots)
    for robot, word in silent[:1]:
        support = f"{word}: {robot.name}"
    is_done, action = bool(robots) and not never, _("Show") if robots else _("Add")
    intent = () if robots else (("add", True),)
    return Step("robots", _("Robots answer"), support, is_done, action, "robots", intent, bool(silent))


def _check_ups(facts: SettingsFacts) -> Step:
    """The first fleet that is not checked up, or robot that is not, or has a problem; a fleet's robots have none."""
    robots = [robot for robot in _in_use(facts) if robot.fleet is None]
    fleets = [fleet for fleet in facts.fleets if fleet.enabled]
    for fleet in fleets:
        if fleet.known is None:
            support, to_fleet = _("Not yet: {robots}").format(robots=fleet.name), (("fleet_id", fleet.id),)
            return Step("check-ups", _("Checked up"), support, False, _("Show"), "robots", to_fleet)
    for robot in robots:
        report = facts.reports.get(robot.id)
        if report is None or outdated(robot, report):
            support, is_wrong = _("Not yet: {robots}").format(robots=robot.name), False
        elif report.level is Level.RED:
            support, is_wrong = f"{robot.name}: {counts(report.findings)}", True
        else:
            continue
        intent = (("check_up", robot.id),)
        return Step("check-ups", _("Checked up"), support, False, _("Show"), "robots", intent, is_wrong)
    return Step("check-ups", _("Checked up"), _named([*fleets, *robots]), bool(robots or fleets), "", "robots")


def _missions(facts: SettingsFacts) -> list[Step]:
    missions, stars = len(facts.missions), sum(mission.favourite for mission in facts.missions)
    fetched = ngettext("{n} mission", "{n} missions", missions).format(n=missions) if missions else _("none yet")
    on_home = _("{n} on Home").format(n=stars) if stars else _("none yet")
    return [
        Step("missions", _("Missions fetched"), fetched, bool(missions), _("Fetch"), "missions", (("fetch", True),)),
        Step("favourites", _("Favourites"), on_home, bool(stars), _("Choose"), "missions"),
    ]


def _values(facts: SettingsFacts) -> Iterator[Step]:
    """Only while a schedule would not start for its values."""
    for schedule in [each for each in facts.schedules if each.id in facts.refused][:1]:
        support, intent = f"{schedule.name}: {wrong_values()}", (("schedule_id", schedule.id),)
        yield Step("values", _("Schedules can start"), support, False, _("Show"), "", intent, True, "scheduler")


def _days(facts: SettingsFacts) -> Step:
    """Somebody has chosen days, public holidays or a day that is closed."""
    settings = facts.settings
    is_done = bool(facts.country or facts.exceptions or settings.working_days != Settings().working_days)
    support = ", ".join(filter(None, (days_phrase(settings.working_days), facts.country)))
    return Step("days", _("Working days"), support, is_done, _("Choose"), "constraints")


def _backup(facts: SettingsFacts) -> Step:
    support = _("none yet")
    if facts.backups:
        support = formats.day_and_time(facts.backups[0].changed_at, facts.settings.timezone)
    return Step("backup", _("Backup"), support, bool(facts.backups), _("Back up"), "data")


def _pin(facts: SettingsFacts) -> Step:
    return Step("pin", _("PIN"), _("Set") if facts.has_pin else _("none yet"), facts.has_pin, _("Choose"), "display")


# ---------------------------------------------------------------------- what is shown
def setup_phrase(taken: list[Step]) -> str:
    """How many are done; empty when all are."""
    done = sum(step.is_done for step in taken)
    return "" if done == len(taken) else _("{done} of {all}").format(done=done, all=len(taken))


def step_items(taken: list[Step], *, is_beside_sheet: bool = False) -> list[Item]:
    """The button of the first one that is not done is the filled one, unless a sheet has one."""
    first = "" if is_beside_sheet else next((step.key for step in taken if not step.is_done), "")
    return [_item(step, is_first=step.key == first) for step in taken]


def _item(step: Step, *, is_first: bool) -> Item:
    icon = "exclamation-thick" if step.is_wrong else "check" if step.is_done else "circle-outline"
    arrow = Action("open", icon="chevron-right")
    later = (Action("later", _("Not now"), style="text"),) if step.key in OPTIONAL else ()
    button = Action("open", step.action, style="filled" if is_first else "outlined")
    return Item(
        step.key,
        step.title,
        step.support,
        icon=icon,
        tone="attention" if step.is_wrong else "neutral",
        disc=True,
        actions=(arrow,) if step.is_done or not step.action else (*later, button),
    )
