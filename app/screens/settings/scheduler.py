"""Settings, Planning: poll interval, retries, time limits, length of the history, and the time zone."""

from __future__ import annotations

from functools import partial
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, NumericProperty, OptionProperty, StringProperty

from app.domain.clock import zone_names
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.common.zones import zone_options
from app.screens.settings.page import PageContext, SettingsPage
from app.services.catalogue import fields
from app.services.catalogue.checks import Number
from app.widgets.fields import Field

RANGES = {field.key: field.check for field in fields.SETTINGS if isinstance(field.check, Number)}


class NumberSetting(Field):
    """A number of the configuration's table of fields, by its key: the range is from there, ``stored`` its value."""

    kind = OptionProperty("step", options=["step"])
    setting = StringProperty()
    stored = NumericProperty()


class SchedulerModel(EventDispatcher):
    history_limit = NumericProperty(100_000)
    history_all = BooleanProperty(False)
    timezone = StringProperty()


class SchedulerPage(SettingsPage):
    Model = SchedulerModel

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._numbers = {each.setting: each for each in self.walk() if isinstance(each, NumberSetting)}
        self._fields = {**self._numbers, "history_limit": self.ids.history_field, "timezone": self.ids.zone_field}
        for name, number in self._numbers.items():
            number.minimum, number.maximum = max(RANGES[name].low, number.minimum), RANGES[name].high
            number.bind(on_commit=lambda each, value: self.step(each.setting, value))

    def show(self) -> None:
        vm, settings = self.vm, self.context.facts.settings
        for name, number in self._numbers.items():
            number.stored = getattr(settings, name)
        vm.history_all = settings.history_limit is None
        if settings.history_limit is not None and not self.context.rests("history_limit"):
            vm.history_limit = settings.history_limit
        vm.timezone = settings.timezone

    def reached(self, **intent: Any) -> None:
        for name in self._fields:
            self._show_problem(name, "")

    # ------------------------------------------------------------------ what is changed
    def step(self, name: str, value: int) -> None:
        save = self.keep if name == "history_limit" else partial(self.set, name)
        if name == "history_limit":
            self.vm.history_limit = value  # its segment too
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
                self._ask_to_delete(surplus, runs)
            else:
                self.set("history_limit", runs)

        self.context.run(lambda: self.context.services.catalogue.runs_beyond(runs), counted, key="history_limit")

    def _ask_to_delete(self, surplus: int, limit: int) -> None:
        """If Settings has been left, a message says that nothing was deleted."""
        if not self.context.is_shown():
            said = ngettext(
                "Not changed: {n} run of the history would be deleted",
                "Not changed: {n} runs of the history would be deleted",
                surplus,
            )
            self.show()
            self.context.say(said.format(n=formats.count(surplus)), "information-outline")
            return
        self.context.shell.sheets.ask(
            ngettext("Delete {n} run of the history?", "Delete {n} runs of the history?", surplus).format(
                n=formats.count(surplus)
            ),
            _("The oldest ones beyond the last {limit} are deleted for ever.").format(limit=formats.count(limit)),
            _("Delete"),
            lambda: self.set("history_limit", limit),
            _("Keep"),
            declined=self.show,
        )

    def pick_timezone(self) -> None:
        self.context.shell.dialogs.choose(
            _("Time zone"),
            zone_options(zone_names(), self.context.now()),
            self._set_timezone,
            selected=self.vm.timezone,
        )

    def _set_timezone(self, name: str) -> None:
        """All times move: a tap on the wrong one can be undone."""
        catalogue, before = self.context.services.catalogue, self.vm.timezone
        if name != before:
            self._show_problem("timezone", "")
            self.context.change(
                lambda: catalogue.change_settings(timezone=name),
                lambda problem: self._show_problem("timezone", sentence_of(problem)),
                undo=(
                    _("The time zone is {zone}").format(zone=name.replace("_", " ")),
                    lambda: catalogue.change_settings(timezone=before),
                ),
                timezone=name,
            )

    def _show_problem(self, name: str, problem: str) -> None:
        self._fields[name].problem = problem
