"""Settings, Missions: the list with favourites and warnings; adding missions by hand or from a robot's own list."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)

from app.domain.models import InvalidInput, Mission, Robot
from app.domain.robot import MissionInfo
from app.i18n import _, ngettext
from app.screens.common.options import Option
from app.screens.common.problems import sentence_of
from app.screens.settings import removals
from app.screens.settings.missions_view import (
    Offer,
    fetched_sentence,
    mission_views,
    offer_options,
    offers,
    typed_minutes,
)
from app.screens.settings.page import PageContext, SettingsPage
from app.screens.settings.places import PlacesBox, PlacesPart
from app.screens.settings.view import NoticeView, done, went_wrong
from app.services.catalogue import mission_edit
from app.services.catalogue.catalogue import Edit
from app.widgets.dialogs import FormDialog
from app.widgets.display import SectionCard
from app.widgets.lists import RecycledRow

SEARCH_FROM = 8  # missions
FETCHED = "missions of a robot"  # what a message is about


class MissionRow(RecycledRow, SectionCard):
    """A mission: star, name and use, warning. Actions: "favourite" (with the wanted state), "edit", "remove"."""

    name = StringProperty()
    note = StringProperty()
    warning = StringProperty()
    favourite = BooleanProperty(False)


class MissionsModel(EventDispatcher):
    rows = ListProperty()
    query = StringProperty()
    searchable = BooleanProperty(False)
    has_missions = BooleanProperty(True)
    can_fetch = BooleanProperty(False)
    fetching = BooleanProperty(False)
    outcome = ObjectProperty(NoticeView())
    part = OptionProperty("missions", options=("missions", "places"))


class MissionsPage(SettingsPage):
    Model = MissionsModel

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._list, self._empty = self.ids.mission_list.__self__, self.ids.no_missions.__self__
        self._head = [self.ids.mission_tools.__self__, self.ids.mission_outcome.__self__]
        self._places_box: PlacesBox | None = None
        self.places = PlacesPart(context)

    @property
    def parts(self) -> list[tuple[str, str]]:
        """One robot alone shares no place."""
        facts = self.context.facts
        has_places = facts.places or (len(facts.robots) > 1 and facts.missions)
        return [("missions", _("Missions")), ("places", _("Places"))] if has_places else []

    def show(self) -> None:
        vm, facts = self.vm, self.context.facts
        self.places.show()
        vm.searchable = len(facts.missions) >= SEARCH_FROM
        vm.can_fetch = any(robot.enabled for robot in facts.robots)
        vm.rows = mission_views(facts, vm.query if vm.searchable else "")
        vm.has_missions = bool(facts.missions)
        self._arrange()

    def _arrange(self) -> None:
        """The missions with their tools, or in their stead the places."""
        shows_places = bool(self.parts) and self.vm.part == "places"
        if shows_places and self._places_box is None:
            self._places_box = PlacesBox(part=self.places)
        if not shows_places:
            self.vm.part = "missions"
        wanted = (
            [self._places_box] if shows_places else [*self._head, self._list if self.vm.has_missions else self._empty]
        )
        here = self.children[::-1]
        if here != wanted:
            self.clear_widgets()
            for widget in wanted:
                self.add_widget(widget)

    @property
    def is_busy(self) -> bool:
        return bool(self.vm.fetching)

    def reached(self, **intent: Any) -> None:
        self.vm.outcome = NoticeView()
        if intent:
            self.turn_to("places" if intent.get("places") else "missions")
        if intent.get("add"):
            self.add()
        if intent.get("fetch"):
            self.begin()
        if "found" in intent and (robot := self.context.facts.robot(intent["found"][0])):
            self._offer(robot, intent["found"][1])

    def begin(self) -> None:
        """The button shown while no missions exist."""
        if self.vm.can_fetch:
            self.fetch()
        else:
            self.context.shell.go("settings", section="robots", add=True)

    def search(self, query: str) -> None:
        self.vm.query = query
        self.show()

    # ------------------------------------------------------------------ single missions
    def act(self, mission_id: int, action: str, *values: Any) -> None:
        mission = self.context.facts.mission(mission_id)
        if mission is None:
            return
        if action == "favourite":
            self._mark(mission_id, values[0])
        elif action == "edit":
            self.context.shell.dialogs.open(MissionDialog(self.context, mission))
        elif action == "remove":
            self._remove(mission)

    def add(self) -> None:
        self.context.shell.dialogs.open(MissionDialog(self.context))

    def _mark(self, mission_id: int, favourite: bool) -> None:
        """Nothing else of it: the stored values may be newer than those shown."""
        self.context.change(
            lambda: self.context.services.catalogue.edit(
                lambda edit: mission_edit.save(edit, replace(edit.the_mission(mission_id), favourite=favourite))
            )
        )

    def _remove(self, mission: Mission) -> None:
        """Ask first if more than the mission is deleted. Undo restores all of it."""
        context, question = self.context, removals.mission_question(self.context.facts, mission)

        def remove() -> None:
            context.remove(
                lambda: context.services.catalogue.remove_mission(mission.id),
                removals.mission_sentence(context.facts, mission),
            )

        if question:
            context.shell.dialogs.confirm(
                _("Delete {mission}?").format(mission=mission.name), question, _("Delete"), remove, danger=True
            )
        else:
            remove()

    # ------------------------------------------------------------------ from a robot
    def fetch(self) -> None:
        """From the only enabled robot at once; of several one is chosen first."""
        robots = [robot for robot in self.context.facts.robots if robot.enabled]
        if len(robots) == 1:
            self._ask(robots[0])
        elif robots:
            options = [Option(robot.id, robot.name, "robot-industrial", robot.model or "") for robot in robots]
            self.context.shell.dialogs.choose(_("Fetch missions from"), options, self._chosen)

    def _chosen(self, robot_id: int) -> None:
        if robot := self.context.facts.robot(robot_id):
            self._ask(robot)

    def _ask(self, robot: Robot) -> None:
        if self.vm.fetching:
            return
        self.vm.fetching = True
        self.context.shell.snackbars.end(FETCHED)
        self.vm.outcome = NoticeView(_("Asking {robot} for its missions …").format(robot=robot.name), icon="timer-sand")
        self.context.run(
            lambda: self.context.services.operator.fetch_missions(robot.id),
            lambda found: self._fetched(robot, found),
            lambda problem: self._not_fetched(robot, problem),
        )

    def _not_fetched(self, robot: Robot, problem: BaseException) -> None:
        self.vm.fetching = False
        self.vm.outcome = went_wrong(problem)
        if not self.is_on_screen:
            self.context.shell.say_not_done(problem, robot, _("Fetch missions"))

    def _fetched(self, robot: Robot, found: Sequence[MissionInfo]) -> None:
        """Not asked if the user has left the page."""
        self.vm.fetching = False
        self.vm.outcome = NoticeView()
        if self.is_on_screen:
            self._offer(robot, found)
        else:
            shell = self.context.shell
            shell.snackbars.undo(
                _("{robot} has sent its missions").format(robot=robot.name),
                _("Choose"),
                lambda: shell.go("settings", section="missions", found=(robot.id, found)),
                stays=True,
                about=FETCHED,
            )

    def _offer(self, robot: Robot, found: Sequence[MissionInfo]) -> None:
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
        if not chosen:
            return

        def save_all(edit: Edit) -> None:
            for offer in chosen:
                mission_edit.save(edit, Mission(offer.name, offer.guid, robot_id=offer.robot_id))

        def saved(_none: None) -> None:
            self.context.refresh()
            self.context.say(ngettext("{n} mission added", "{n} missions added", len(chosen)).format(n=len(chosen)))

        self.context.run(lambda: self.context.services.catalogue.edit(save_all), saved)


class MissionForm(EventDispatcher):
    title = StringProperty()
    name = StringProperty()
    guid = StringProperty()
    robot_id = NumericProperty(0)  # 0: all robots
    robot_name = StringProperty()
    usual_minutes = StringProperty()  # empty: known from its runs only
    low_battery = BooleanProperty(False)
    low_battery_note = StringProperty()
    name_problem = StringProperty()
    guid_problem = StringProperty()
    usual_minutes_problem = StringProperty()
    robot_problem = StringProperty()
    outcome = ObjectProperty(NoticeView())
    saving = BooleanProperty(False)
    is_new = BooleanProperty(True)
    details = BooleanProperty(True)  # the GUID is shown


class MissionDialog(FormDialog):
    """Adds a mission by name and GUID, or edits one."""

    vm = ObjectProperty(None, rebind=True, allownone=True)

    def __init__(self, context: PageContext, mission: Mission | None = None, **kwargs: Any) -> None:
        self._context, self._mission = context, mission
        form = MissionForm(title=_("Edit mission") if mission else _("Add mission"))
        if mission is not None:
            form.name, form.guid, form.robot_id = mission.name, mission.guid, mission.robot_id or 0
            form.usual_minutes, form.low_battery = str(mission.usual_minutes or ""), mission.on_low_battery
            form.is_new = form.details = False
        form.low_battery_note = (
            _("It charges the robot, so it starts at any battery level")
            if mission is not None and mission.charges
            else _("Also under the minimum battery; missions that charge the robot always do")
        )
        super().__init__(vm=form, **kwargs)
        self._name_robot()
        for name in ("name", "guid", "usual_minutes"):
            form.fbind(name, self._edited, name)

    def _edited(self, name: str, *_args: Any) -> None:
        setattr(self.vm, f"{name}_problem", "")

    def _name_robot(self) -> None:
        robot = self._context.facts.robot(int(self.vm.robot_id))
        self.vm.robot_name = _("Only {robot}").format(robot=robot.name) if robot else _("The same on all robots")

    def pick_robot(self) -> None:
        """For the rare mission whose GUID differs between robots."""
        options = [
            Option(0, _("The same on all robots")),
            *(Option(robot.id, _("Only {robot}").format(robot=robot.name)) for robot in self._context.facts.robots),
        ]
        self._context.shell.dialogs.choose(_("On which robots"), options, self._picked, selected=int(self.vm.robot_id))

    def _picked(self, robot_id: int) -> None:
        self.vm.robot_id, self.vm.robot_problem = robot_id, ""
        self._name_robot()

    def save(self) -> None:
        form = self.vm
        if form.saving:
            return
        form.saving = True
        mission = replace(
            self._mission or Mission("", ""),
            name=form.name.strip(),
            guid=form.guid.strip(),
            robot_id=int(form.robot_id) or None,
            usual_minutes=typed_minutes(form.usual_minutes),
            on_low_battery=form.low_battery,
        )
        self._context.run(lambda: self._context.services.catalogue.save_mission(mission), self._saved, self._refused)

    def _saved(self, mission: Mission) -> None:
        self.dismiss()
        self._context.was_saved("missions", mission)
        self._context.say(
            (_("{mission} saved") if self._mission else _("{mission} added")).format(mission=mission.name)
        )

    def _refused(self, problem: BaseException) -> None:
        form = self.vm
        form.saving = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        if field in ("name", "guid", "robot", "usual_minutes"):
            setattr(form, f"{field}_problem", sentence_of(problem))
            form.details = form.details or field == "guid"
        else:
            form.outcome = went_wrong(problem)
