"""Settings, Planning: poll interval, retries, time limits, length of the history, and the time zone."""

from __future__ import annotations

from typing import Any

from kivy.properties import NumericProperty, ObjectProperty, OptionProperty, StringProperty

from app.domain.clock import zone_names
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.threads import Job
from app.screens.common.zones import zone_options
from app.screens.settings.page import ValuesPage
from app.services.catalogue import fields
from app.services.catalogue.checks import Number
from app.widgets.fields import Field

RANGES = {field.key: field.check for field in fields.SETTINGS if isinstance(field.check, Number)}


class NumberSetting(Field):
    """A number of the configuration's table of fields, by its key: the range is from there, ``stored`` its value."""

    kind = OptionProperty("step", options=["step"])
    page = ObjectProperty(None, rebind=True, allownone=True)
    setting = StringProperty()
    stored = NumericProperty()

    def on_setting(self, *_args: Any) -> None:
        self.minimum, self.maximum = RANGES[self.setting].low, RANGES[self.setting].high

    def on_commit(self, value: int) -> None:
        self.page.set(self.setting, value)


class SchedulerPage(ValuesPage):
    history_limit = NumericProperty(100_000)
    _count: Job | None = None  # of what a lower limit would delete

    @property
    def is_busy(self) -> bool:
        return self._count is not None and not self._count.finished

    def show(self) -> None:
        super().show()
        limit = self.settings.history_limit
        if limit is not None and not self.is_busy:
            self.history_limit = limit

    # ------------------------------------------------------------------ what is changed
    def keep_all(self, wanted: bool) -> None:
        if wanted:
            self.set("history_limit", None)
        else:
            self.keep(int(self.history_limit))

    def keep(self, runs: int) -> None:
        """Limit the history; what that would delete is asked first."""
        self.history_limit = runs  # its segment too

        def counted(surplus: int) -> None:
            if surplus:
                self._ask_to_delete(surplus, runs)
            else:
                self.set("history_limit", runs)

        catalogue = self.context.services.catalogue
        self._count = self.context.run(lambda: catalogue.runs_beyond(runs), counted, key="history_limit")

    def _ask_to_delete(self, surplus: int, limit: int) -> None:
        self.context.shell.sheets.ask(
            ngettext("Delete {n} run of the history?", "Delete {n} runs of the history?", surplus).format(
                n=formats.count(surplus)
            ),
            _("The oldest ones beyond the last {limit} are deleted for ever.").format(limit=formats.count(limit)),
            _("Delete"),
            lambda: self.set("history_limit", limit),
            _("Keep"),
        )

    def pick_timezone(self) -> None:
        self.context.shell.dialogs.choose(
            _("Time zone"),
            zone_options(zone_names(), self.context.now()),
            self._set_timezone,
            selected=self.settings.timezone,
        )

    def _set_timezone(self, name: str) -> None:
        """All times move: a tap on the wrong one can be undone."""
        catalogue, before = self.context.services.catalogue, self.settings.timezone
        if name != before:
            self.problems.pop("timezone", None)
            self.context.save(
                lambda problem: self.refuse("timezone", problem),
                (
                    _("The time zone is {zone}").format(zone=name.replace("_", " ")),
                    lambda: catalogue.change_settings(timezone=before),
                ),
                timezone=name,
            )
