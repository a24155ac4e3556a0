"""The form's fields: their actions and questions."""

from __future__ import annotations

from dataclasses import replace
from datetime import time
from typing import Any

from kivy.properties import AliasProperty, NumericProperty, StringProperty

from app.i18n import _
from app.screens.common import formats
from app.screens.common.missing_mission import fetch_option, or_fetch
from app.screens.scheduler import form_view, of_groups
from app.screens.scheduler.asked import AsksRobot
from app.screens.scheduler.draft import BEGINS_AT, DAY_BEGINS, MOST, Kind, Unit
from app.screens.scheduler.form_view import MORE
from app.widgets.dialogs import Overlay


class FormFields(AsksRobot):
    """A question closes with its form. ``page`` is the field that the sheet asks for, in the place of all
    of them."""

    page = StringProperty()
    hour = NumericProperty(0)  # on it
    minute = NumericProperty(0)
    missing = StringProperty()  # which of the mission's values has to be given first
    _has_hour = False  # it was chosen: the minute completes the time

    def _ask(self, question: Overlay) -> None:
        """Until the form closes: messages above a dialog can be pressed, and a waiting Save runs at some time."""

        def close(*_args: object) -> None:
            question.dismiss()

        self.fbind("is_open", close)
        question.fbind("on_dismiss", lambda _question: self.funbind("is_open", close))

    def set(self, **values: Any) -> None:
        """Change fields of the draft."""
        self._change(replace(self._draft, **values))

    def remedy(self, values: tuple[tuple[str, Any], ...]) -> None:
        """A note's button was pressed: fields, and their values."""
        changed = dict(values)
        day = changed.pop("day", None)
        self._change(replace(self._draft if day is None else self._draft.with_day(day), **changed))

    def choose_mission(self) -> None:
        if not form_view.mission_options(self._facts, self._draft.target):
            self._shell.dialogs.confirm(
                _("No missions yet"),
                _("Missions are made on the robot. In Settings they are fetched from it."),
                _("Open Settings"),
                lambda: self._shell.go("settings", section="missions"),
            )
            return
        self.choose("mission_id")

    def pick_day(self) -> None:
        today = self._local_now().date()
        self._ask(
            self._shell.dialogs.pick_date(
                _("Day") if self._draft.kind is Kind.ONCE else _("First day"),
                self._draft.day,
                lambda day: self._change(self._draft.with_day(day)),
                today=today,
                first=min(today, self._draft.day),
            )
        )

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

    # ------------------------------------------------------------------ a time, in the sheet itself
    def pick_time(self, field: str) -> None:
        at: time = getattr(self._draft, field)
        self._has_hour = False
        self.hour, self.minute, self.page = at.hour, at.minute, field

    def choose_hour(self, hour: int) -> None:
        self.hour, self._has_hour = hour, True

    def choose_minute(self, minute: int) -> None:
        """After an hour it is the rest of the time."""
        self.minute = minute
        if self._has_hour:
            self.set_time()

    def step_minute(self, direction: int) -> None:
        self.minute = (self.minute + direction) % 60

    def set_time(self) -> None:
        field, at = self.page, time(int(self.hour), int(self.minute))
        self.page = ""
        self.set(**{field: at})

    def leave_page(self) -> None:
        """The arrow: nothing has changed."""
        self.page = ""

    def _get_time_text(self) -> str:
        return formats.wall_time(time(int(self.hour), int(self.minute)))

    time_text = AliasProperty(_get_time_text, bind=("hour", "minute"))

    def _get_set_text(self) -> str:
        return _("Set {time}").format(time=self.time_text)

    set_time_text = AliasProperty(_get_set_text, bind=("hour", "minute"))

    # ------------------------------------------------------------------ the other fields
    def choose_kind(self, kind: str) -> None:
        """Of the rarer ones first that of so many minutes."""
        if kind == MORE:
            self._repeat((Kind.OTHER, "") if self._draft.other_rule else form_view.REPEATS[0])
        else:
            self.set(kind=Kind(kind))

    def choose_repeats(self) -> None:
        options, selected = form_view.repeats_options(self._draft), form_view.repeats_of(self._draft)
        self._ask(self._shell.dialogs.choose(_("Repeats"), options, self._repeat, selected=selected))

    def _repeat(self, key: tuple[Kind, Any]) -> None:
        """A new "every …" is for the day, until other times are chosen. A number was meant for its own unit: "1 hour"
        must not become "every minute"."""
        kind, which = key
        draft = replace(self._draft, kind=kind)
        if kind is Kind.MONTHLY:
            draft = replace(draft, by_weekday=which)
        elif kind is Kind.EVERY:
            if draft.unit is not which:
                draft = replace(draft, unit=which, every=BEGINS_AT[which])
            if self._draft.kind is not Kind.EVERY and self._draft.is_new:
                draft = replace(draft, at=DAY_BEGINS)
            if draft.until_time <= draft.at:
                draft = replace(draft, until_time=time(23, 59))
        self._change(draft)

    def toggle_day(self, day: str) -> None:
        days = self._draft.weekdays
        self.set(weekdays=tuple(d for d in days if d != day) if day in days else (*days, day))

    def step_every(self, direction: int) -> None:
        """Minutes by five from ten on, else one by one."""
        draft, number = self._draft, self._draft.every
        step = 5 if draft.unit is Unit.MINUTES and min(number, number + direction) >= 10 else 1
        self.set(every=min(max(number + step * direction, 1), MOST[draft.unit]))

    def step(self, field: str, direction: int) -> None:
        """To the next value of a number."""
        self.set(**{field: form_view.stepped(self._facts, self._draft, field, direction)})

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

    def choose(self, field: str) -> None:
        """Pick the value of a field of the draft."""
        draft, facts = self._draft, self._facts
        title, options = {
            "mission_id": (_("Mission"), form_view.mission_options(facts, draft.target)),
            "target": (_("Robot"), of_groups.target_options(facts)),
            "nth": (_("Which one of the month"), form_view.nth_options()),
            "month_weekday": (_("Weekday"), form_view.weekday_options()),
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
                selected=getattr(draft, field),
                last=fetch_option() if field == "mission_id" else None,
            )
        )
