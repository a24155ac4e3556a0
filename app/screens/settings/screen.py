"""Settings: a list of sections with their present values on the left, the open one on the right; in portrait one at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.screens.common.mission_names import MissionNameLookup
from app.screens.common.shell import Shell
from app.screens.common.view_model import Changed, Refresher, ScreenBase, ViewModel
from app.screens.settings.about import AboutPage
from app.screens.settings.constraints import ConstraintsPage
from app.screens.settings.data import DataPage
from app.screens.settings.display import DisplayPage
from app.screens.settings.edit_sheet import SettingsSheet
from app.screens.settings.facts import SettingsFacts, SettingsServices, read
from app.screens.settings.idle import IdlePage
from app.screens.settings.missions import MissionsPage
from app.screens.settings.page import PageContext, SettingsPage
from app.screens.settings.robots import RobotsPage
from app.screens.settings.scheduler import SchedulerPage
from app.screens.settings.setup import SetupPage
from app.screens.settings.setup_view import setup_phrase, steps
from app.screens.settings.view import answers, section_items, section_names
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.display import RowsCard
from app.widgets.events import Fires
from app.widgets.scrolling import ScrollPage
from app.widgets.tabs import Tab

PAGES: dict[str, type[SettingsPage]] = {
    "setup": SetupPage,
    "robots": RobotsPage,
    "missions": MissionsPage,
    "constraints": ConstraintsPage,
    "idle": IdlePage,
    "scheduler": SchedulerPage,
    "display": DisplayPage,
    "data": DataPage,
    "about": AboutPage,
}
FIRST = "robots"
SHOWN_TOPICS = (
    Topic.ROBOTS,
    Topic.MISSIONS,
    Topic.SCHEDULES,
    Topic.SETTINGS,
    Topic.CALENDAR,
)  # snapshots are read once a second
KV = (
    "settings/screen",
    *(f"settings/{name}" for name in PAGES),
    "settings/robot",
    "settings/fleet",
    "settings/find",
    "settings/check_up",
    "settings/groups",
    "settings/places",
    "settings/mission",
    "settings/days",
    "settings/calendar",
)


class SettingsViewModel(Fires, ViewModel):
    """Which section is open, and the facts that all of them show."""

    sections = ListProperty()
    current = StringProperty(FIRST)
    is_narrow = BooleanProperty(False)  # portrait: either the list or the section
    is_narrow_open = BooleanProperty(False)  # portrait: the section is shown
    scrolled = NumericProperty(1)  # where its page was when it was left

    __events__ = ("on_facts",)

    def __init__(self, services: SettingsServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self._refresher: Refresher[SettingsFacts] = Refresher(shell, lambda: lambda: read(services), self._take)
        self.context = PageContext(services, shell, self._refresher.reread, self.show)
        self._given = MissionNameLookup(services.robot_missions, services.clock, shell, self._refresher.request)
        self.has_facts = False  # nothing is shown before the first reading: defaults would look like settings
        self._waiting: list[Callable[[], object]] = []  # for the first facts of this visit

    # ------------------------------------------------------------------ reading
    def opened(self, *_args: Any, **_intent: Any) -> None:
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._refresher.start())
        self.every(1, self._tick)
        self._refresher.read()

    def closed(self) -> None:
        self._waiting.clear()
        self.context.page_left()

    def retranslated(self) -> None:
        self.show()

    def _changed(self, event: Changed) -> None:
        if event.topic in SHOWN_TOPICS:
            self._refresher.request()

    def _take(self, facts: SettingsFacts) -> None:
        self.context.take(replace(facts, mission_names=self._shell.mission_names.known))
        self.has_facts = True
        self._learn_missions(facts)
        self._given.look(
            facts.robots,
            (
                (schedule.robot_id, mission.guid, schedule.parameters)
                for schedule in facts.schedules
                if (mission := facts.mission(schedule.mission_id)) is not None
            ),
        )
        self.show()
        while self._waiting:
            self._waiting.pop(0)()

    def once_read(self, call: Callable[[], object]) -> None:
        """Call it when the facts of this visit are there."""
        self._waiting.append(call)

    def _learn_missions(self, facts: SettingsFacts) -> None:
        """Read the robots' missions, so that missing ones can be marked; from each robot at most once a minute."""
        for robot in facts.robots:
            if answers(facts, robot):
                ask = partial(self._services.robot_missions.learn_names, robot.id)
                self._shell.background.run(ask, self._learnt, lambda _problem: None, apart="names")

    def _learnt(self, is_new: bool) -> None:
        if is_new:
            self._refresher.request()

    # ------------------------------------------------------------------ showing
    def _tick(self) -> None:
        """A second has passed: show how the robots answer now, which is in memory."""
        if not self.has_facts:
            self._refresher.request()  # the first reading has failed
            return
        facts = self.context.facts
        snapshots = {robot.id: self._services.snapshots.get(robot.id) for robot in facts.robots}
        if any(
            snapshots[robot.id].connection is not facts.snapshot(robot.id).connection
            or (robot.identified_by is None and answers(facts, robot))
            for robot in facts.robots
        ):
            self._refresher.request()  # a robot's identity is stored at its first answer
        self.context.facts = replace(facts, snapshots=snapshots)
        self.show()

    def show(self) -> None:
        if not self.has_facts:
            return
        marked = "" if self.is_narrow and not self.is_narrow_open else self.current
        facts = self.context.facts
        self.sections = section_items(facts, self.context.now(), marked, setup_phrase(steps(facts)))
        self.dispatch("on_facts")


class SectionList(RowsCard):
    """The sections; a tap opens one."""

    screen = ObjectProperty(None, allownone=True)

    def reveal(self, section: str) -> None:
        """Scroll to the row of a section that was opened from elsewhere, where not all have room."""
        self.ids.section_rows.reveal(section)


class SettingsScreen(ScreenBase):
    Services, Model = SettingsServices, SettingsViewModel

    def __init__(self, vm: SettingsViewModel, **kwargs: Any) -> None:
        load_kv(*KV)
        self._pages: dict[str, SettingsPage] = {}
        super().__init__(vm=vm, **kwargs)
        self._columns = self.ids.columns.__self__
        self._list = SectionList(vm=self.vm, screen=self)
        self._content = BoxLayout()
        self.fbind("size", self._resized)
        self._arrange()

    # ------------------------------------------------------------------ coming on screen
    def shown(self, section: str | None = None, **intent: Any) -> None:
        """``shell.go("settings", section="robots", add=True)``; without a section the last one, where it was left."""
        self.vm.bind(on_facts=self._show_page, is_narrow_open=self._arrange)
        super().shown()
        self.vm.once_read(partial(self.open, section, **intent) if section in PAGES else self._come_back)

    def hidden(self) -> None:
        scroll = self._scroll()
        self.vm.scrolled = scroll.scroll_y if scroll is not None else 1
        self.vm.unbind(on_facts=self._show_page, is_narrow_open=self._arrange)  # a later screen shows them
        super().hidden()

    def _scroll(self) -> ScrollPage | None:
        """What the open page scrolls in, if it does."""
        return next((widget for widget in self.page.walk(restrict=True) if isinstance(widget, ScrollPage)), None)

    def _come_back(self) -> None:
        self.page.reached()
        if (scroll := self._scroll()) is not None:
            Clock.schedule_once(
                lambda _dt: setattr(scroll, "scroll_y", self.vm.scrolled), 0
            )  # once it has been laid out

    # ------------------------------------------------------------------ sections
    def open(self, section: str, **intent: Any) -> None:
        """Show a section."""
        self.vm.context.page_left()
        self.vm.current = section
        self.vm.is_narrow_open = True
        self.vm.show()
        Clock.schedule_once(lambda _dt: self._list.reveal(section), 0)  # after the rows have been laid out
        self.page.reached(**intent)
        self._show_page()

    def go_back(self) -> None:
        """Where it is narrow: to the list."""
        self.vm.context.shell.sheets.give_up()
        self.vm.is_narrow_open = False

    @property
    def page(self) -> SettingsPage:
        """The page of the open section. Other pages are only kept while something is under way there: each is a sixth
        of the window."""
        section = self.vm.current
        page = self._pages.get(section) or PAGES[section](self.vm.context)
        self._pages = {**{name: other for name, other in self._pages.items() if other.is_busy}, section: page}
        return page

    def choose_tab(self, key: str) -> None:
        """Another part of the open section."""
        if self.page.parts:
            self.vm.context.shell.sheets.give_up()
            self.page.turn_to(key)
            self._show_page()

    def _show_page(self, *_args: Any) -> None:
        place, page = self._content, self.page
        if page.parent is not place:
            place.clear_widgets()
            place.add_widget(page)
        page.show()
        if isinstance(sheet := self.vm.context.shell.sheets.top, SettingsSheet):
            sheet.show_facts()
        section = self.vm.current
        is_list = self.vm.is_narrow and not self.vm.is_narrow_open
        parts = page.parts or ((section, section_names()[section]),)
        self.tabs = [] if is_list else [Tab(key, word) for key, word in parts]
        self.tab = page.vm.part if page.parts else section
        self.can_go_back = self.vm.is_narrow_open and self.vm.is_narrow

    def _is_narrow(self) -> bool:
        """Whether words of the list would be broken next to a section."""
        return bool(self.height > self.width or self.width < sp(700))

    def _resized(self, *_args: Any) -> None:
        if self._is_narrow() != self.vm.is_narrow:
            self._arrange()

    def _arrange(self, *_args: Any) -> None:
        """List and section side by side, or one of them alone."""
        narrow = self.vm.is_narrow = self._is_narrow()
        shown = [self._list, self._content]
        if narrow:
            shown = [self._content if self.vm.is_narrow_open else self._list]
        self._list.size_hint_x, self._content.size_hint_x = (1, 1) if narrow else (None, 1)
        self._list.width = dp(264 if Window.height < dp(700) else 304)
        self._columns.clear_widgets()
        for widget in shown:
            self._columns.add_widget(widget)
        self.vm.show()
