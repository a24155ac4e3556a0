"""The top bar and the banner of every screen. Reads robots, alarms and holds in the background, ticks once a second."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from kivy.clock import Clock

from app.domain.clock import zone_names
from app.domain.execution import Execution
from app.i18n import _, ngettext, translator
from app.screens.common import formats
from app.screens.common.alarms_view import Act, alarm_text, bell, doubts_clock, is_over, is_shelved
from app.screens.common.holding import HAND, about_hold, about_start
from app.screens.common.mission_names import MissionNameLookup
from app.screens.common.shell import Shell
from app.screens.common.view_model import Changed, Refresher
from app.screens.frame.alarms import AlarmsModel
from app.screens.frame.dimming import Dimming, is_night
from app.screens.frame.facts import FrameFacts, FrameServices, read
from app.screens.frame.late_starts import LateStarts
from app.screens.frame.sounding import Sounding
from app.screens.frame.view import (
    banner,
    counting_down,
    held_back,
    new_lines,
    open_lines,
    whose_plan,
    zone_asked,
)
from app.services.live.changes import Topic
from app.widgets.frame import Frame
from app.widgets.snackbar import Message

NAVIGATION = (
    ("home", "home-variant-outline", "home-variant"),
    ("scheduler", "calendar-clock-outline", "calendar-clock"),
    ("logs", "text-box-outline", "text-box"),
    ("settings", "cog-outline", "cog"),
)
T = TypeVar("T")


def screen_word(name: str) -> str:
    return {
        "home": _("Home"),
        "scheduler": _("Scheduler"),
        "logs": _("Logs"),
        "settings": _("Settings"),
        "alarms": _("Alarms"),
    }[name]


class FrameController:
    """Fills the Frame widget and runs the actions of its bar and banner."""

    Services = FrameServices

    def __init__(self, services: FrameServices, shell: Shell, frame: Frame) -> None:
        self._services, self._shell, self._frame = services, shell, frame
        self._facts = FrameFacts()
        self._is_read = False  # the facts
        self._reader = Refresher(shell, lambda: lambda: read(services), self._take)
        self.alarms = AlarmsModel(services, shell, self._do, lambda: shell.go(self._left))
        self._left = "home"  # the screen from which the alarms were opened
        self._sounding = Sounding()
        self._dimming = Dimming(services.clock)
        self._given = MissionNameLookup(services.robot_missions, services.clock, shell, self._show)
        self._late = LateStarts(services, shell, self._hold_starts, self._ask_to_release)
        self._zone_is_asked = False  # once, without having been pressed for
        self._release: list[Callable[[], object]] = []

    # ------------------------------------------------------------------ life
    def start(self) -> None:
        self._shell.navigator.bind(current=self._went, all_robots=self._went, robot_id=self._went)
        self._release = [
            self._shell.bus.subscribe(Changed, self._changed),
            self._reader.start(),
            translator.subscribe(self._retranslated),
            Clock.schedule_interval(lambda _dt: self._show(), 1).cancel,
        ]
        self._dimming.start()
        self.use(self._frame)
        self._reader.read()

    def use(self, frame: Frame) -> None:
        """Fill this one from now on."""
        self._frame = frame
        frame.bind(on_go=self._go, on_solve=self._press_banner)
        frame.ids.bar.bind(on_list_alarms=self._show_alarms)
        self._retranslated()

    def stop(self) -> None:
        self._dimming.stop()
        for release in self._release:
            release()
        self._release = []

    def _changed(self, event: Changed) -> None:
        """Snapshots are shown every second anyway."""
        if event.topic is not Topic.SNAPSHOT:
            self._reader.request()

    def _retranslated(self) -> None:
        self._frame.items = [(name, screen_word(name), icon, selected) for name, icon, selected in NAVIGATION]
        self._went()

    def _went(self, *_: Any) -> None:
        current = self._shell.navigator.current
        if current and current != "alarms":
            self._left = current
        self._frame.ids.bar.title = screen_word(current) if current else ""
        self._show()  # the banner of this screen, before it is shown
        self._frame.current = current

    # ------------------------------------------------------------------ showing
    def _take(self, facts: FrameFacts) -> None:
        before, self._facts, self._is_read = self._facts.robot, facts, True
        if facts.robot and (before is None or before.id != facts.robot.id):
            self._services.engine.watch(facts.robot.id)
        self._given.look(
            facts.robots.values(), ((e.robot_id, e.mission_guid, e.parameters) for e in facts.issues.late_starts)
        )
        self._show()
        self.alarms.changed()
        if facts.issues.guessed_zone and not self._zone_is_asked:
            self._ask_zone()

    def _show(self) -> None:
        facts, bar, now = self._facts, self._frame.ids.bar, self._services.clock.now()
        issues = replace(facts.issues, mission_names=self._shell.mission_names.known)
        if self._is_read:  # until then the time zone is not known
            bar.clock = formats.clock_time(now, facts.settings.timezone)
        self._late.show(issues, facts.settings, now)
        said = replace(issues, late_starts=()) if self._late.is_shown else issues
        self._frame.banner = banner(said, facts.robots, facts.settings, now, self._shell.navigator.current)
        bar.clock_in_doubt = any(map(doubts_clock, issues.alarms))
        lines = open_lines(issues.alarms, now)
        new = len(new_lines(lines))
        shelved = [alarm for alarm in issues.alarms if is_shelved(alarm, now) and not is_over(alarm)]
        bar.bell_icon, bar.bell_count = bell(new, len(lines), len(shelved))
        self._dimming.look(not new and is_night(facts.settings, now))
        self.alarms.show(issues.alarms, facts.robots, facts.settings)
        sounds = self._sounding.is_due(issues.alarms, now, self._services.clock.monotonic())
        if sounds and facts.settings.alarm_sound and self._shell.loudspeaker is not None:
            self._shell.loudspeaker.play()

    # ------------------------------------------------------------------ the bar
    def _go(self, _frame: Frame, name: str) -> None:
        if name != self._shell.navigator.current:
            self._shell.go(name)

    # ------------------------------------------------------------------ the banner
    def _press_banner(self, _frame: Frame) -> None:
        self._do(self._frame.banner.act, self._frame.banner.about)

    def _do(self, act: Act, about: Any) -> None:
        """Run an action of the banner or of an alarm."""
        services = self._services
        match act:
            case Act.GO:
                self._shell.go(**about)
            case Act.SCHEDULE_RUN:
                self._work(lambda: services.history.last_of_schedule(about), self._show_run)
            case Act.HOLD:
                self._hold_starts([e.id for e in counting_down(self._facts.issues.late_starts)], True)
            case Act.LATE_STARTS:
                self._late.open()
                self._show()
            case Act.RELEASE:
                self._release_hold(about)
            case Act.CLOCK_IS_RIGHT:
                self._ask_clock()
            case Act.TIME_ZONE:
                self._ask_zone()
            case Act.WHOSE_PLAN:
                self._shell.dialogs.choose(_("This data is a copy"), whose_plan(), self._decide)

    def _work(self, work: Callable[[], T], done: Callable[[T], object] | None = None) -> None:
        """In the background; its effect is published on the bus."""
        self._shell.background.run(work, done, self._shell.say_problem)

    def _ask_clock(self) -> None:
        now, settings = self._services.clock.now(), self._facts.settings
        doubt = " ".join(alarm_text(alarm, settings, now) for alarm in self._facts.issues.alarms if doubts_clock(alarm))
        self._shell.sheets.ask(
            _("Is it {day}, {time}?").format(
                day=formats.day(now, settings.timezone), time=formats.clock_time(now, settings.timezone)
            ),
            doubt + ".\n" + _("If not, set the clock in the tablet's own settings."),
            _("This clock is right"),
            lambda: self._work(self._services.holds.confirm_clock),
            _("No, send nothing"),
        )

    def _ask_zone(self) -> None:
        self._zone_is_asked = True
        self._choose_zone(self._facts.settings.timezone)

    def _choose_zone(self, guess: str) -> None:
        """It is a setting: if a PIN protects settings, it is asked for first."""
        question, options = zone_asked(zone_names(), guess, self._services.clock.now())
        self._shell.dialogs.choose(
            question,
            options,
            lambda zone: self._shell.navigator.past_guard("settings", lambda: self._take_zone(zone, guess)),
        )

    def _take_zone(self, zone: str, guess: str) -> None:
        """Undone, it is asked for again."""
        catalogue = self._services.catalogue
        self._work(
            lambda: catalogue.change_settings(timezone=zone),
            lambda _settings: self._shell.offer_undo(
                _("The time zone is {zone}").format(zone=zone),
                lambda: catalogue.guess_zone_again(guess),
                lambda: self._choose_zone(guess),
                behind="settings",
            ),
        )

    def _decide(self, moves_here: bool) -> None:
        tablet = self._services.tablet
        self._work(tablet.move_here if moves_here else tablet.view_only)

    def _show_run(self, execution: Execution | None) -> None:
        """In Logs; all runs when the history has no longer this one."""
        self._shell.go("logs", execution_id=execution.id if execution else None, unfiltered=execution is None)

    def _release_hold(self, robot_id: int | None) -> None:
        """Of that robot, or of all (None). What nothing waits for can be undone."""
        holds, count = self._services.holds, held_back(self._facts.issues, robot_id, self._services.clock.now())
        hold = next((hold for hold in self._facts.issues.holds if hold.robot_id == robot_id and not hold.clock), None)
        said, about = _("No longer on hold"), about_hold(robot_id)

        def released(_none: None) -> None:
            if count or hold is None:
                self._shell.snackbars.show(said, icon="play", about=about)
            else:
                self._shell.offer_undo(
                    said, lambda: holds.hold(hold.reason, hold.until, robot_id), self._reader.request, about=about
                )

        self._ask_to_release(count, lambda: self._work(lambda: holds.release(robot_id), released))

    def _ask_to_release(self, count: int, release: Callable[[], object]) -> None:
        """What starts at once can't be undone."""
        if not count:
            release()
            return
        title = ngettext("{n} start is due now", "{n} starts are due now", count).format(n=count)
        self._shell.sheets.ask(title, "", _("Release"), release, _("Keep hold"))

    def _hold_starts(self, ids: Sequence[int], held: bool) -> None:
        """Put only these on hold, or start them."""
        snackbars, about = self._shell.snackbars, [about_start(execution_id) for execution_id in ids]

        def done(number: int) -> None:
            sent = len(ids) - number
            if not held:
                for each in about:
                    snackbars.end(each)
            else:
                kept = ngettext("{n} start is on hold", "{n} starts are on hold", number)
                late = ngettext("{n} start had already been sent", "{n} starts had already been sent", sent)
                said = late.format(n=sent) if sent else kept.format(n=number)
                snackbars.post(Message(said, HAND if not sent else "information-outline", about=frozenset(about)))

        self._work(lambda: self._services.operator.hold_starts(ids, held), done)

    def _show_alarms(self, _frame: Frame) -> None:
        if self._shell.navigator.current != "alarms":
            self._shell.go("alarms")
