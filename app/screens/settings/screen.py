"""Settings: the integrator's place. Sections with their present value left, the open one right; one after the other in portrait."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.container import Container
from app.i18n import _
from app.screens.common.shell import Shell
from app.screens.common.view_model import ScreenBase, ViewModel
from app.screens.settings.about import AboutPage
from app.screens.settings.constraints import ConstraintsPage
from app.screens.settings.data import DataPage
from app.screens.settings.display import DisplayPage
from app.screens.settings.facts import SettingsFacts, read
from app.screens.settings.idle import IdlePage
from app.screens.settings.missions import MissionsPage
from app.screens.settings.page import Desk, SettingsPage
from app.screens.settings.robots import RobotsPage
from app.screens.settings.scheduler import SchedulerPage
from app.screens.settings.view import answers, section_names, section_rows
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.display import SectionCard

PAGES: dict[str, type[SettingsPage]] = {
    "robots": RobotsPage, "missions": MissionsPage, "constraints": ConstraintsPage, "idle": IdlePage, "scheduler": SchedulerPage,
    "display": DisplayPage, "data": DataPage, "about": AboutPage}
FIRST = "robots"
SHOWN_TOPICS = (Topic.ROBOTS, Topic.MISSIONS, Topic.SCHEDULES, Topic.SETTINGS, Topic.CALENDAR)       # snapshots are looked at once a second
KV = ("settings/screen", *(f"settings/{name}" for name in PAGES), "settings/robot", "settings/mission", "settings/days", "widgets/month",
      "settings/calendar")


class SettingsViewModel(ViewModel):
    """Which section is open, and the facts that all of them show."""
    sections = ListProperty()
    current = StringProperty(FIRST)
    title = StringProperty()
    note = StringProperty()
    is_narrow = BooleanProperty(False)           # portrait: list and section one after the other
    is_narrow_open = BooleanProperty(False)      # the section stands in the place of the list

    __events__ = ("on_facts",)

    def __init__(self, container: Container, shell: Shell) -> None:
        super().__init__()
        self._container, self._shell = container, shell
        self.desk = Desk(container, shell, self.refresh)
        self._reading = self._stale = False
        self.has_facts = False                           # until they are read once nothing is shown: defaults would pass for settings
        self._read_soon = Clock.create_trigger(lambda _dt: self.refresh(), 0)
        self._waiting: list[Callable[[], object]] = []   # for the first facts

    def on_facts(self) -> None:
        """New facts, or a second has passed."""

    # ------------------------------------------------------------------ reading
    def opened(self, section: str | None = None, **intent: Any) -> None:
        self.keep(self._container.changes.subscribe(self._heard))
        self.keep(self._read_soon.cancel)
        self.every(1, self._look)
        self.refresh()

    def retranslated(self) -> None:
        self.show()

    def _heard(self, topic: Topic, _about: int | None) -> None:
        """On the publisher's thread; many changes within a frame are one reading."""
        if topic in SHOWN_TOPICS:
            self._read_soon()

    def refresh(self) -> None:
        """Read anew. One reading at a time; what changes meanwhile asks for one more. A screen that is not shown reads nothing."""
        if not self.is_open:
            return
        if self._reading:
            self._stale = True
            return
        self._reading, self._stale = True, False
        desk = self.desk
        self._shell.background.run(lambda: read(self._container, desk.robot_missions, desk.files), self._take, self._not_read)

    def _take(self, facts: SettingsFacts) -> None:
        self._reading = False
        if self._stale:
            self._read_soon()
        self.desk.facts, self.has_facts = facts, True
        self._learn_missions(facts)
        self.show()
        while self._waiting:
            self._waiting.pop(0)()

    def _not_read(self, problem: BaseException) -> None:
        self._reading = False
        self._shell.say_problem(problem)

    def once_read(self, call: Callable[[], object]) -> None:
        """Call it when the facts of this visit are there."""
        self._waiting.append(call)

    def _learn_missions(self, facts: SettingsFacts) -> None:
        """Which missions the robots have, so that missing ones can be flagged; each is asked once a minute at most."""
        for robot in facts.robots:
            if answers(facts, robot):
                self._shell.background.run(lambda robot_id=robot.id: self.desk.robot_missions.learn_names(robot_id),
                                           lambda new: self._read_soon() if new else None, lambda _problem: None,
                                           key=("settings", "missions", robot.id))

    # ------------------------------------------------------------------ showing
    def _look(self) -> None:
        """A second has passed: how the robots answer now, which is in memory."""
        if not self.has_facts:
            self.refresh()                               # what could not be read may be readable now
            return
        facts = self.desk.facts
        snapshots = {robot.id: self._container.snapshots.get(robot.id) for robot in facts.robots}
        if any(snapshot.connection is not facts.snapshot(robot_id).connection for robot_id, snapshot in snapshots.items()):
            self.refresh()                               # a robot that answers for the first time has told who it is
        self.desk.facts = replace(facts, snapshots=snapshots)
        self.show()

    def show(self) -> None:
        if not self.has_facts:
            return
        marked = "" if self.is_narrow and not self.is_narrow_open else self.current
        self.sections = section_rows(self.desk.facts, self.desk.now(), marked)
        self.title = section_names()[self.current]
        self.note = "" if self.current in ("data", "about") else _("Every change is saved at once")
        self.dispatch("on_facts")


class SectionList(SectionCard):
    """The sections; a tap opens one."""
    screen = ObjectProperty(None, allownone=True)

    def reveal(self, section: str) -> None:
        """Scroll to the row of a section that was opened from elsewhere, where not all have room."""
        rows = self.ids.section_rows
        if rows.ids.rows.height > rows.height:
            rows.show(section)


class SectionContent(BoxLayout):
    """The open section under its name; ``narrow`` shows the way back to the list."""
    vm = ObjectProperty(None, rebind=True, allownone=True)
    screen = ObjectProperty(None, allownone=True)
    narrow = BooleanProperty(False)


class SettingsScreen(ScreenBase):
    def __init__(self, container: Container, shell: Shell, **kwargs: Any) -> None:
        load_kv(*KV)
        self._pages: dict[str, SettingsPage] = {}
        super().__init__(vm=SettingsViewModel(container, shell), **kwargs)
        self._list = SectionList(vm=self.vm, screen=self)
        self._content = SectionContent(vm=self.vm, screen=self)
        self.vm.bind(on_facts=self._show_page, is_narrow_open=self._arrange)
        self.fbind("portrait", self._arrange)
        self._arrange()

    # ------------------------------------------------------------------ coming on screen
    def shown(self, section: str | None = None, **intent: Any) -> None:
        """``shell.go("settings", section="robots", add=True)``; without a section the last one."""
        super().shown()
        if section in PAGES:
            self.vm.once_read(lambda: self.open(section, **intent))
        else:
            self.vm.once_read(lambda: self._page.reached())

    def place(self) -> dict[str, Any]:
        """The intent that leads back here."""
        return {"section": self.vm.current}

    # ------------------------------------------------------------------ sections
    def open(self, section: str, **intent: Any) -> None:
        """Show a section."""
        self.vm.current = section
        self.vm.is_narrow_open = True
        self.vm.show()
        Clock.schedule_once(lambda _dt: self._list.reveal(section), 0)       # after the rows have their places
        self._page.reached(**intent)

    def close(self) -> None:
        """Portrait: back to the list."""
        self.vm.is_narrow_open = False

    @property
    def _page(self) -> SettingsPage:
        """The page of the open section, built on its first visit."""
        section = self.vm.current
        if section not in self._pages:
            self._pages[section] = PAGES[section](self.vm.desk)
        return self._pages[section]

    def _place_page(self) -> None:
        place, page = self._content.ids.place.__self__, self._page
        if page.parent is not place:
            place.clear_widgets()
            place.add_widget(page)

    def _show_page(self, *_args: Any) -> None:
        self._place_page()
        self._page.show(self.vm.desk.facts, self.vm.desk.now())

    def _arrange(self, *_args: Any) -> None:
        """List and section beside each other, or one of them alone."""
        self._content.narrow = self.vm.is_narrow = self.portrait
        shown = [self._list, self._content]
        if self.portrait:
            shown = [self._content if self.vm.is_narrow_open else self._list]
        self._list.size_hint_x, self._content.size_hint_x = (1, 1) if self.portrait else (.26, .74)
        self.clear_widgets()
        for widget in shown:
            self.add_widget(widget)
        self.vm.show()
