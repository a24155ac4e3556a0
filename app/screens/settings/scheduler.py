"""Settings, Scheduler: poll interval, retries, time limits, length of the history, and the time zone."""

from __future__ import annotations

from functools import partial
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, NumericProperty, StringProperty

from app.domain.clock import zone_names
from app.i18n import _
from app.screens.common.problems import sentence_of
from app.screens.common.zones import zone_options
from app.screens.settings.page import SettingsPage

NUMBERS = (
    "poll_interval_seconds",
    "retry_limit",
    "start_window_minutes",
    "unknown_outcome_quiet_seconds",
    "history_limit",
)


class SchedulerModel(EventDispatcher):
    poll_interval_seconds = NumericProperty(30)
    poll_interval_seconds_problem = StringProperty()
    retry_limit = NumericProperty(10)
    retry_limit_problem = StringProperty()
    start_window_minutes = NumericProperty(15)
    start_window_minutes_problem = StringProperty()
    unknown_outcome_quiet_seconds = NumericProperty(90)
    unknown_outcome_quiet_seconds_problem = StringProperty()
    history_limit = NumericProperty(100_000)
    history_limit_problem = StringProperty()
    history_all = BooleanProperty(False)
    timezone = StringProperty()
    timezone_problem = StringProperty()


class SchedulerPage(SettingsPage):
    Model = SchedulerModel

    def show(self) -> None:
        vm, settings = self.vm, self.context.facts.settings
        for name in NUMBERS:
            value = getattr(settings, name)
            if value is not None:
                setattr(vm, name, value)
        vm.history_all = settings.history_limit is None
        vm.timezone = settings.timezone

    def reached(self, **intent: Any) -> None:
        for name in (*NUMBERS, "timezone"):
            self._show_problem(name, "")

    # ------------------------------------------------------------------ what is changed
    def step(self, name: str, value: int) -> None:
        save = self.keep if name == "history_limit" else partial(self.set, name)
        self.context.save_at_rest(name, lambda: save(value))

    def set(self, name: str, value: Any) -> None:
        self.context.pass_over(name)
        self._show_problem(name, "")
        self.context.save(lambda problem: self._show_problem(name, sentence_of(problem)), **{name: value})

    def keep_all(self, wanted: bool) -> None:
        if wanted:
            self.set("history_limit", None)
        else:
            self.keep(int(self.vm.history_limit))

    def keep(self, runs: int) -> None:
        """Limit the history; what that would delete is asked first."""
        self.context.pass_over("history_limit")
        self.vm.history_limit = runs

        def counted(surplus: int) -> None:
            if surplus:
                self.ask_to_delete(
                    surplus,
                    _("The oldest ones beyond the last {limit} are deleted for ever.").format(limit=runs),
                    _("Delete"),
                    lambda: self.set("history_limit", runs),
                )
            else:
                self.set("history_limit", runs)

        self.context.run(lambda: self.context.services.catalogue.runs_beyond(runs), counted, key="history_limit")

    def pick_timezone(self) -> None:
        self.context.shell.dialogs.choose(
            _("Time zone"),
            zone_options(zone_names(), self.context.now()),
            lambda name: self.set("timezone", name),
            selected=self.vm.timezone,
        )

    def _show_problem(self, name: str, problem: str) -> None:
        setattr(self.vm, f"{name}_problem", problem)
