"""Settings, Missions: the list with favourites and what is missing where; by hand, or from what a robot offers."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.domain.models import InvalidInput, Mission, Robot
from app.domain.robot import MissionInfo
from app.i18n import _, ngettext
from app.screens.common.problems import sentence_of
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.missions_view import (
    Offer,
    fetched_sentence,
    mission_rows,
    offer_options,
    offers,
    removal_sentence,
    typed_minutes,
)
from app.screens.settings.page import BAR_BESIDE, Desk, OutcomeModel, SettingsPage
from app.screens.settings.view import NoticeView, went_wrong
from app.services.catalogue.catalogue import Edit
from app.widgets.dialogs import FormDialog
from app.widgets.lists import RecycledRow
from app.widgets.surfaces import Surface

SEARCH_FROM = 8                          # missions


class MissionRow(RecycledRow, Surface):
    """A mission: star, name and use, what is wrong with it. Actions: "favourite" (with the wanted state), "edit", "remove"."""
    name = StringProperty()
    note = StringProperty()
    guid = StringProperty()
    warning = StringProperty()
    favourite = BooleanProperty(False)


class MissionsModel(EventDispatcher):
    rows = ListProperty()
    query = StringProperty()
    searchable = BooleanProperty(False)
    has_missions = BooleanProperty(True)
    can_fetch = BooleanProperty(False)
    fetching = BooleanProperty(False)
    outcome = ObjectProperty(rebind=True)


class MissionsPage(SettingsPage):
    def __init__(self, desk: Desk, **kwargs: Any) -> None:
        super().__init__(desk, MissionsModel(outcome=OutcomeModel()), **kwargs)
        self._list, self._empty = self.ids.mission_list.__self__, self.ids.no_missions.__self__
        self.vm.bind(has_missions=self._arrange)
        self._arrange()

    def _arrange(self, *_args: Any) -> None:
        """The list, or what to do while there is none."""
        self.show_one(self._list if self.vm.has_missions else self._empty, (self._list, self._empty))

    def begin(self) -> None:
        """The way out of having no missions."""
        if self.vm.can_fetch:
            self.fetch()
        else:
            self.desk.shell.go("settings", section="robots", add=True)

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        vm = self.vm
        vm.searchable = len(facts.missions) >= SEARCH_FROM
        vm.can_fetch = any(robot.enabled for robot in facts.robots)
        vm.rows = mission_rows(facts, vm.query if vm.searchable else "")
        vm.has_missions = bool(facts.missions)

    def reached(self, **intent: Any) -> None:
        self.vm.outcome.tell(NoticeView())
        if intent.get("add"):
            self.add()

    def search(self, query: str) -> None:
        self.vm.query = query
        self.show(self.desk.facts, self.desk.now())

    # ------------------------------------------------------------------ single missions
    def act(self, mission_id: int, action: str, *values: Any) -> None:
        mission = self.desk.facts.mission(mission_id)
        if mission is None:
            return
        if action == "favourite":
            self._save(replace(mission, favourite=values[0]))
        elif action == "edit":
            self.desk.shell.dialogs.open(MissionDialog(self.desk, mission))
        elif action == "remove":
            self._remove(mission)

    def add(self) -> None:
        self.desk.shell.dialogs.open(MissionDialog(self.desk))

    def _save(self, mission: Mission) -> None:
        self.desk.work(lambda: self.desk.container.catalogue.save_mission(mission), lambda _saved: self.desk.refresh())

    def _remove(self, mission: Mission) -> None:
        """At once; the schedules that use it go with it and come back with Undo."""
        catalogue, text = self.desk.container.catalogue, removal_sentence(self.desk.facts, mission)

        def removed(what: Any) -> None:
            self.desk.refresh()
            self.desk.offer_undo(text, lambda: self.desk.work(lambda: catalogue.restore(what), lambda _none: self.desk.refresh()))
        self.desk.work(lambda: catalogue.remove_mission(mission.id), removed)

    # ------------------------------------------------------------------ from a robot
    def fetch(self) -> None:
        """Of one robot at once; of several the person says which."""
        robots = [robot for robot in self.desk.facts.robots if robot.enabled]
        if len(robots) == 1:
            self._ask(robots[0])
        elif robots:
            options = [{"key": robot.id, "text": robot.name, "note": robot.model or "", "icon": "robot-industrial"} for robot in robots]
            self.desk.shell.dialogs.choose(_("Fetch missions from"), options, self._chosen)

    def _chosen(self, robot_id: int) -> None:
        if robot := self.desk.facts.robot(robot_id):
            self._ask(robot)

    def _ask(self, robot: Robot) -> None:
        if self.vm.fetching:
            return
        self.vm.fetching = True
        self.vm.outcome.tell(NoticeView(_("Asking {robot} for its missions …").format(robot=robot.name), icon="timer-sand"))
        self.desk.work(lambda: self.desk.container.operator.fetch_missions(robot.id), lambda found: self._fetched(robot, found),
                       self._not_fetched)

    def _not_fetched(self, problem: BaseException) -> None:
        self.vm.fetching = False
        self.vm.outcome.tell(went_wrong(problem))

    def _fetched(self, robot: Robot, found: Sequence[MissionInfo]) -> None:
        self.vm.fetching = False
        self.vm.outcome.tell(NoticeView())
        offered = offers(found, self.desk.facts.missions, robot.id)
        if sentence := fetched_sentence(offered, robot):
            self.vm.outcome.tell(NoticeView(sentence, tone="done" if offered else "attention", icon="check-circle" if offered else "alert"))
            return
        self.desk.shell.dialogs.choose_many(
            _("Missions of {robot}").format(robot=robot.name), offer_options(offered), _("Add chosen"),
            lambda guids: self._take_over([offer for offer in offered if offer.guid in guids]))

    def _take_over(self, chosen: Sequence[Offer]) -> None:
        if not chosen:
            return
        catalogue = self.desk.container.catalogue

        def save_all(edit: Edit) -> None:
            for offer in chosen:
                edit.save_mission(Mission(offer.name, offer.guid, robot_id=offer.robot_id))

        def saved(_none: None) -> None:
            self.desk.refresh()
            self.desk.say(ngettext("{n} mission added", "{n} missions added", len(chosen)).format(n=len(chosen)))
        self.desk.work(lambda: catalogue.edit(save_all), saved)


class MissionForm(EventDispatcher):
    title = StringProperty()
    name = StringProperty()
    guid = StringProperty()
    robot_id = NumericProperty(0)        # 0: all robots
    robot_name = StringProperty()
    usual_minutes = StringProperty()     # empty: only its runs tell
    name_problem = StringProperty()
    guid_problem = StringProperty()
    usual_minutes_problem = StringProperty()
    robot_problem = StringProperty()
    problem = StringProperty()
    saving = BooleanProperty(False)


class MissionDialog(FormDialog):
    """Adds a mission by name and guid, or edits one."""
    vm = ObjectProperty(None, rebind=True, allownone=True)

    def __init__(self, desk: Desk, mission: Mission | None = None, **kwargs: Any) -> None:
        self._desk, self._mission = desk, mission
        form = MissionForm(title=_("Edit mission") if mission else _("Add mission"))
        if mission is not None:
            form.name, form.guid, form.robot_id = mission.name, mission.guid, mission.robot_id or 0
            form.usual_minutes = str(mission.usual_minutes or "")
        super().__init__(vm=form, **kwargs)
        self.ids.page.bar_margin = BAR_BESIDE
        self._name_robot()
        for name in ("name", "guid", "usual_minutes"):
            form.fbind(name, self._edited, name)

    def _edited(self, name: str, *_args: Any) -> None:
        setattr(self.vm, f"{name}_problem", "")

    def _name_robot(self) -> None:
        robot = self._desk.facts.robot(int(self.vm.robot_id))
        self.vm.robot_name = _("Only {robot}").format(robot=robot.name) if robot else _("The same on all robots")

    def pick_robot(self) -> None:
        """For the rare mission whose guid differs between robots."""
        options = [{"key": 0, "text": _("The same on all robots")},
                   *({"key": robot.id, "text": _("Only {robot}").format(robot=robot.name)} for robot in self._desk.facts.robots)]
        self._desk.shell.dialogs.choose(_("Where this guid holds"), options, self._picked, selected=int(self.vm.robot_id))

    def _picked(self, robot_id: int) -> None:
        self.vm.robot_id, self.vm.robot_problem = robot_id, ""
        self._name_robot()

    def save(self) -> None:
        form = self.vm
        if form.saving:
            return
        form.saving = True
        mission = replace(self._mission or Mission("", ""), name=form.name.strip(), guid=form.guid.strip(),
                          robot_id=int(form.robot_id) or None, usual_minutes=typed_minutes(form.usual_minutes))
        self._desk.work(lambda: self._desk.container.catalogue.save_mission(mission), self._saved, self._refused)

    def _saved(self, mission: Mission) -> None:
        self.dismiss()
        self._desk.refresh()
        self._desk.say((_("{mission} saved") if self._mission else _("{mission} added")).format(mission=mission.name))

    def _refused(self, problem: BaseException) -> None:
        form = self.vm
        form.saving = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        if field in ("name", "guid", "robot", "usual_minutes"):
            setattr(form, f"{field}_problem", sentence_of(problem))
        else:
            form.problem = sentence_of(problem)
