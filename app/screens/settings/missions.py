"""Settings, Missions: which robot has which; adding missions by hand or from a robot's own list."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from kivy.event import EventDispatcher
from kivy.metrics import sp
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivymd.icon_definitions import md_icons

from app.domain.models import Mission, Robot
from app.domain.robot import MissionInfo
from app.i18n import _, ngettext
from app.screens.common.robot_appearance import robot_option
from app.screens.settings import removals
from app.screens.settings.edit_sheet import EditSheet
from app.screens.settings.missions_view import (
    Cell,
    Choice,
    Offer,
    columns,
    fetched_sentence,
    mission_lines,
    mission_note,
    offer_options,
    offers,
)
from app.screens.settings.page import PageContext, SettingsPage
from app.screens.settings.places import PlacesPart
from app.screens.settings.view import NoticeView, done, went_wrong
from app.services.catalogue import mission_edit
from app.services.catalogue.catalogue import Edit, Removed
from app.widgets.children import refill
from app.widgets.items import Option
from app.widgets.lists import Row
from app.widgets.surfaces import Tap
from app.widgets.text import Txt

SEARCH_FROM = 8  # missions
NAMES, COLUMN = 324, 72  # sp: all but the columns of robots, and one of these


class MissionRow(Row, Tap):
    """A mission. Actions: "favourite" (with the wanted state), "open" (a tap)."""


class MissionCell(Txt):
    """An icon or a text."""

    cell = ObjectProperty(Cell(), rebind=True)

    def on_cell(self, *_args: Any) -> None:
        self.font_name, self.font_size = ("Icons", "24dp") if self.cell.icon else ("Roboto", "16sp")
        self.text = md_icons[self.cell.icon] if self.cell.icon else self.cell.text


class MissionCells(BoxLayout):
    """One for each column."""

    cells = ListProperty()

    def on_cells(self, *_args: Any) -> None:
        widgets = refill(self, range(len(self.cells)), lambda _n: MissionCell())
        for widget, cell in zip(widgets, self.cells, strict=True):
            widget.cell = cell


class MissionsModel(EventDispatcher):
    rows = ListProperty()
    heads = ListProperty()  # of the columns
    choice = ObjectProperty(Choice(), rebind=True)
    whose = StringProperty()  # the chosen group; empty: there are none
    missing = StringProperty()  # how many some robot misses; empty: none
    searchable = BooleanProperty(False)
    searching = BooleanProperty(False)
    can_fetch = BooleanProperty(False)
    fetching = BooleanProperty(False)
    outcome = ObjectProperty(NoticeView())
    part = OptionProperty("missions", options=("missions", "places"))


class MissionsPage(SettingsPage):
    Model = MissionsModel
    shown = StringProperty()  # the table of missions, in its stead the places, or what to do first

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.places = PlacesPart(context)
        self.fbind("width", lambda *_args: self.show())

    @property
    def parts(self) -> list[tuple[str, str]]:
        """One robot alone shares no place."""
        facts = self.context.facts
        has_places = facts.places or (len(facts.robots) > 1 and facts.missions)
        return [("missions", _("Missions")), ("places", _("Places"))] if has_places else []

    def show(self) -> None:
        vm, facts = self.vm, self.context.facts
        if not self.parts:
            vm.part = "missions"
        self.places.show()
        vm.searchable = len(facts.missions) >= SEARCH_FROM
        vm.can_fetch = any(robot.enabled for robot in facts.robots)
        missing = sum(bool(facts.robots_missing(mission)) for mission in facts.missions)
        vm.missing = _("Missing {n}").format(n=missing) if missing else ""
        group = facts.group(vm.choice.group_id)
        vm.choice = replace(
            vm.choice, only_missing=vm.choice.only_missing and bool(missing), group_id=group.id if group else 0
        )
        vm.whose = (group.name if group else _("All robots")) if facts.groups else ""
        most = max(1, int((self.width - sp(NAMES)) / sp(COLUMN)))
        vm.heads = [Cell(text=head) for head, _robots in columns(facts, vm.choice, most)]
        vm.rows = mission_lines(facts, vm.choice, most)
        self.shown = "PlacesBox" if vm.part == "places" else "MissionTable" if facts.missions else "NoMissions"

    @property
    def is_busy(self) -> bool:
        return bool(self.vm.fetching)

    def reached(self, **intent: Any) -> None:
        self.vm.outcome = NoticeView()
        if intent:
            self.turn_to("places" if intent.get("places") else "missions")
        if "group_id" in intent:
            self.choose(group_id=intent["group_id"], only_missing=True)
        if intent.get("add"):
            self.add()
        if intent.get("fetch"):
            self.begin()
        if robot := self.context.facts.robot(intent.get("fetch_from")):
            self._ask(robot)

    def begin(self) -> None:
        """The button shown while no missions exist."""
        if self.vm.can_fetch:
            self.fetch()
        else:
            self.context.shell.go("settings", section="robots", add=True)

    # ------------------------------------------------------------------ which are shown
    def choose(self, **values: Any) -> None:
        self.vm.choice = replace(self.vm.choice, **values)
        self.show()

    def turn_search(self) -> None:
        self.vm.searching = not self.vm.searching
        self.choose(query="")

    def choose_group(self) -> None:
        groups = [Option(group.id, group.name, "account-group-outline") for group in self.context.facts.groups]
        self.context.shell.dialogs.choose(
            _("Robots"),
            [Option(0, _("All robots"), "robot-outline"), *groups],
            lambda group_id: self.choose(group_id=group_id),
            selected=self.vm.choice.group_id,
        )

    # ------------------------------------------------------------------ single missions
    def act(self, mission_id: int, action: str, *values: Any) -> None:
        mission = self.context.facts.mission(mission_id)
        if mission is None:
            return
        if action == "favourite":
            self._mark(mission_id, values[0])
        else:
            self.context.shell.sheets.show(MissionSheet(self.context, mission))

    def add(self) -> None:
        self.context.shell.sheets.show(MissionSheet(self.context))

    def _mark(self, mission_id: int, favourite: bool) -> None:
        """Nothing else of it: the stored values may be newer than those shown."""
        self.context.change(
            lambda: self.context.services.catalogue.edit(
                lambda edit: mission_edit.save(edit, replace(edit.the(Mission, mission_id), favourite=favourite))
            )
        )

    # ------------------------------------------------------------------ from a robot
    def fetch(self) -> None:
        """From the only enabled robot at once; of several one is chosen first."""
        robots = [robot for robot in self.context.facts.robots if robot.enabled]
        if len(robots) == 1:
            self._ask(robots[0])
        elif robots:
            options = list(map(robot_option, robots))
            self.context.shell.dialogs.choose(_("Fetch missions from"), options, self._chosen)

    def _chosen(self, robot_id: int) -> None:
        if robot := self.context.facts.robot(robot_id):
            self._ask(robot)

    def _ask(self, robot: Robot) -> None:
        if self.vm.fetching:
            return
        self.vm.fetching = True
        self.vm.outcome = NoticeView(_("Asking {robot} for its missions …").format(robot=robot.name), icon="timer-sand")
        self.context.run(
            lambda: self.context.services.operator.fetch_missions(robot.id),
            lambda found: self._fetched(robot, found),
            lambda problem: self._not_fetched(robot, problem),
        )

    def _not_fetched(self, robot: Robot, problem: BaseException) -> None:
        self.vm.fetching = False
        self.vm.outcome = went_wrong(problem, robot.name)
        if self.context.is_late:
            self.context.shell.say_not_done(problem, robot, _("Fetch missions"))

    def _fetched(self, robot: Robot, found: Sequence[MissionInfo]) -> None:
        self.vm.fetching = False
        self.vm.outcome = NoticeView()
        offered = offers(found, self.context.facts.missions, robot.id)
        if sentence := fetched_sentence(offered, robot):
            self.vm.outcome = done(sentence) if offered else NoticeView(sentence, tone="attention", icon="alert")
            return
        self.context.shell.dialogs.choose_many(
            _("Missions of {robot}").format(robot=robot.name),
            offer_options(offered),
            _("Add chosen"),
            lambda guids: self._add_chosen([offer for offer in offered if offer.guid in guids]),
            can_all=True,
            needs_one=True,
        )

    def _add_chosen(self, chosen: Sequence[Offer]) -> None:
        def save_all(edit: Edit) -> None:
            for offer in chosen:
                mission_edit.save(edit, Mission(offer.name, offer.guid, robot_id=offer.robot_id))

        def saved(_none: None) -> None:
            self.context.refresh()
            self.context.say(ngettext("{n} mission added", "{n} missions added", len(chosen)).format(n=len(chosen)))

        self.context.run(lambda: self.context.services.catalogue.edit(save_all), saved)


class MissionSheet(EditSheet):
    """Adds a mission by name and GUID, or edits one."""

    kind = "missions"
    fields = ("name", "guid", "usual_minutes", "robot")

    minutes = StringProperty()  # as they are typed; empty: known from its runs only
    robot_name = StringProperty()
    details = BooleanProperty(True)  # the GUID is shown

    def __init__(self, context: PageContext, mission: Mission | None = None) -> None:
        it = mission or Mission("", "")
        super().__init__(context, it, minutes=str(it.usual_minutes or ""), details=mission is None)

    def show_facts(self) -> None:
        super().show_facts()
        if self.stored is not None:
            self.about = mission_note(self.context.facts, self.stored)

    def on_it(self, *_args: Any) -> None:
        robot = self.context.facts.robot(self.it.robot_id)
        self.robot_name = _("Only {robot}").format(robot=robot.name) if robot else _("The same on all robots")

    def on_problems(self, *_args: Any) -> None:
        self.details = self.details or "guid" in self.problems

    def pick_robot(self) -> None:
        """For the rare mission whose GUID differs between robots."""
        options = [
            Option(0, _("The same on all robots")),
            *(Option(robot.id, _("Only {robot}").format(robot=robot.name)) for robot in self.context.facts.robots),
        ]
        self.context.shell.dialogs.choose(
            _("On which robots"),
            options,
            lambda robot_id: self.enter(robot_id=robot_id or None),
            selected=self.it.robot_id or 0,
        )

    def question(self) -> str:
        return removals.mission_question(self.context.facts, self.stored)

    def delete(self, it: Mission) -> Removed:
        return self.context.services.catalogue.remove_mission(it.id)
