"""The form's fields: their actions and questions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, time
from typing import Any

from kivy.properties import ObjectProperty

from app.domain.models import Schedule
from app.i18n import _
from app.screens.common.missing_mission import fetch_option, or_fetch
from app.screens.scheduler import form_view, of_groups
from app.screens.scheduler.asked import AsksRobot
from app.screens.scheduler.draft import BEGINS_AT, Draft, Kind, Unit
from app.screens.scheduler.form_view import FormView, Preview
from app.screens.scheduler.step_dialog import StepDialog
from app.widgets.dialogs import Overlay
from app.widgets.fields import whole_number


class FormFields(AsksRobot):
    """``view`` is what is shown. A question is about the draft in the form, ``entry``, and closes when another one takes its place."""

    view = ObjectProperty(FormView(), rebind=True)
    entry = ObjectProperty(None, allownone=True)  # of the draft in the form
    _preview: Preview
    _skip: Callable[[Schedule, datetime], object]
    _again: Callable[[Schedule, datetime], object]

    def _local_now(self) -> datetime:
        raise NotImplementedError

    def _change(self, draft: Draft) -> None:
        raise NotImplementedError

    def _ask(self, question: Overlay, about: str = "entry") -> None:
        """Until that property changes: messages above a dialog can be pressed, and a waiting Save runs at some time."""

        def close(*_args: object) -> None:
            question.dismiss()

        self.fbind(about, close)
        question.fbind("on_dismiss", lambda _question: self.funbind(about, close))

    def set(self, **values: Any) -> None:
        """Change fields of the draft."""
        self._change(replace(self._draft, **values))

    def choose_mission(self) -> None:
        if not form_view.mission_options(self._facts, self._draft.target):
            self._shell.dialogs.confirm(
                _("No missions yet"),
                _("Missions are made on the robot; in Settings they are fetched from it."),
                _("Open Settings"),
                lambda: self._shell.go("settings", section="missions"),
            )
            return
        self.choose("mission_id")

    def pick_day(self) -> None:
        today = self._local_now().date()
        self._ask(
            self._shell.dialogs.pick_date(
                self.view.day_label,
                self._draft.day,
                lambda day: self._change(self._draft.with_day(day)),
                today=today,
                first=min(today, self._draft.day),
            )
        )

    def take_free(self) -> None:
        """The offered time, without an overlap with another run of the robot."""
        if self._preview.forecast is not None and (free := self._preview.forecast.free_at) is not None:
            self.set(at=free.time())

    def choose_skip(self) -> None:
        """Of the starts that are shown: one to be skipped, or one that is skipped, to be started after all."""
        schedule, forecast = self._draft.base, self._preview.forecast
        if schedule is None or forecast is None:
            return
        title = _("Skip or restore which start of {name}?") if forecast.skipped else _("Skip which start of {name}?")
        self._ask(
            self._shell.dialogs.choose(
                title.format(name=self._facts.called(schedule)),
                form_view.skip_options(forecast, self._draft, self._services.clock.now()),
                lambda at: self._again(schedule, at) if at in forecast.skipped else self._skip(schedule, at),
            )
        )

    def pick_time(self) -> None:
        self._ask(self._shell.dialogs.pick_time(self.view.time_label, self._draft.at, lambda at: self.set(at=at)))

    def pick_until(self) -> None:
        self._ask(self._shell.dialogs.pick_time(_("Until"), self._draft.until_time, lambda at: self.set(until_time=at)))

    def pick_last_day(self) -> None:
        self._ask(
            self._shell.dialogs.pick_date(
                _("Last day"),
                self._draft.last_day or self._draft.day,
                lambda day: self.set(last_day=day),
                today=self._local_now().date(),
                first=self._draft.day,
            )
        )

    def choose_kind(self, kind: str) -> None:
        """ "Interval" begins with an end that is after its beginning."""
        draft = self._draft
        later = {}
        if kind == Kind.EVERY and draft.until_time <= draft.at:
            later["until_time"] = time(min(draft.at.hour + 8, 23), 59 if draft.at.hour >= 16 else draft.at.minute)
        self.set(kind=Kind(kind), **later)

    def toggle_day(self, day: str) -> None:
        days = self._draft.weekdays
        self.set(weekdays=tuple(d for d in days if d != day) if day in days else (*days, day))

    def type_every(self, text: str) -> None:
        try:
            self.set(every=whole_number(text))
        except ValueError:
            self.set(every=None)

    def choose_unit(self, unit: str) -> None:
        """The number was meant for the other unit: "1 hour" must not become "every minute"."""
        if unit != self._draft.unit:
            self.set(unit=Unit(unit), every=BEGINS_AT[Unit(unit)])

    def choose_also(self) -> None:
        self._ask(
            self._shell.dialogs.choose_many(
                _("Also at"),
                form_view.also_options(self._draft),
                _("Set"),
                lambda hours: self.set(more_hours=tuple(hours)),
                selected=self._draft.more_hours,
            )
        )

    def step_to(self, field: str) -> None:
        """Ask for the number of one of the draft's fields."""
        self._ask(
            self._shell.dialogs.open(
                StepDialog(
                    form_view.steps(self._facts, self._draft, field),
                    getattr(self._draft, field),
                    lambda chosen: self.set(**{field: chosen}),
                )
            )
        )

    def choose(self, field: str) -> None:
        """Pick the value of a field of the draft."""
        draft, facts = self._draft, self._facts
        selected = getattr(draft, field)
        title, options = {
            "mission_id": (_("Mission"), form_view.mission_options(facts, draft.target)),
            "target": (_("Robot"), of_groups.target_options(facts)),
            "nth": (_("Which one of the month"), form_view.nth_options()),
            "month_weekday": (_("Weekday"), form_view.weekday_options()),
            "overlap": (_("When the previous run is still open"), form_view.overlap_options(draft)),
        }[field]
        self._ask(
            self._shell.dialogs.choose(
                title,
                options,
                or_fetch(
                    self._shell,
                    lambda key: self._change(
                        self._draft.aimed_at(key) if field == "target" else replace(self._draft, **{field: key})
                    ),
                ),
                selected=selected,
                last=fetch_option() if field == "mission_id" else None,
            )
        )
